"""A Conan 2 recipe of the C and C++ library: ``conan create recipe/conan`` in a checkout."""

import os
import re

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load


class Minsnap(ConanFile):
    """minsnap::minsnap, of the files of minsnap/native."""

    name = "minsnap"
    description = "Minimum-snap quadrotor trajectories, certified inside their corridor at every instant"
    license = "MIT"
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False]}
    default_options = {"shared": True}

    @property
    def _checkout(self):
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        header = load(self, os.path.join(self._checkout, "minsnap", "native", "include", "minsnap.h"))
        self.version = re.search(r'MINSNAP_VERSION "(.+?)"', header).group(1)

    def export_sources(self):
        native = os.path.join(self._checkout, "minsnap", "native")
        for pattern in ("CMakeLists.txt", "src/*", "include/*", "cmake/*"):
            copy(self, pattern, src=native, dst=self.export_sources_folder)
        copy(self, "LICENSE", src=self._checkout, dst=self.export_sources_folder)

    def validate(self):
        if self.settings.compiler == "msvc":
            raise ConanInvalidConfiguration("minsnap needs the vector extensions of GCC and Clang")

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeToolchain(self).generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", src=self.source_folder, dst=os.path.join(self.package_folder, "licenses"))

    def package_info(self):
        self.cpp_info.libs = ["minsnap"]
        self.cpp_info.set_property("cmake_file_name", "minsnap")
        self.cpp_info.set_property("cmake_target_name", "minsnap::minsnap")
        if self.settings.os in ("Linux", "FreeBSD"):
            self.cpp_info.system_libs = ["pthread"]
