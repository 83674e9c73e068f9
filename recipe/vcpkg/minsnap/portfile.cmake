# A port of a checkout: vcpkg install minsnap --overlay-ports=recipe/vcpkg. A registry takes vcpkg_from_github in place of the first line.
set(checkout "${CMAKE_CURRENT_LIST_DIR}/../../..")
vcpkg_cmake_configure(SOURCE_PATH "${checkout}/minsnap/native" OPTIONS -DBUILD_TESTING=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/minsnap)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include")
vcpkg_install_copyright(FILE_LIST "${checkout}/LICENSE")
