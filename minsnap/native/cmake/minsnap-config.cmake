# The library of an installed wheel: find_package(minsnap) with minsnap_DIR or CMAKE_PREFIX_PATH as `minsnap --cmake-dir` prints it.
get_filename_component(_native "${CMAKE_CURRENT_LIST_DIR}" DIRECTORY)
if(NOT EXISTS "${_native}/_core.bin")
  set(minsnap_FOUND FALSE)
  set(minsnap_NOT_FOUND_MESSAGE "this wheel of minsnap holds no compiled core: install one that does, or build ${_native} with cmake")
  return()
endif()
if(NOT TARGET minsnap::minsnap)
  add_library(minsnap::minsnap SHARED IMPORTED)
  set_target_properties(minsnap::minsnap PROPERTIES IMPORTED_LOCATION "${_native}/_core.bin" IMPORTED_IMPLIB "${_native}/_core.bin"
                                                    INTERFACE_INCLUDE_DIRECTORIES "${_native}/include"
                                                    INTERFACE_COMPILE_FEATURES cxx_std_17)
endif()
unset(_native)
