"""Compile the native core while a wheel is made; without a compiler the wheel is pure Python.

``MINSNAP_REQUIRE_NATIVE=1`` makes a missing or failing compiler fail the installation.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from compileall import compile_dir
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import platform_tags


class NativeCoreHook(BuildHookInterface[Any]):  # type: ignore[misc, unused-ignore]
    """Adds the compiled library to a wheel, or compiles it in place for an editable one."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and mark the wheel as one for this platform if that succeeded."""
        recipe = _recipe(Path(self.root))
        if version == "editable":
            compile_dir(str(Path(self.root) / "minsnap"), quiet=2)  # an installer does so for the files that it copies
        try:
            if version == "editable":
                recipe.build()
            else:
                self._include(recipe, build_data)
        except (recipe.NoCompilerError, recipe.CompilationError) as error:
            self._go_on_without(recipe, version, build_data, error)
        else:
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{_platform()}"

    def _include(self, recipe: ModuleType, build_data: dict[str, Any]) -> None:
        """Compile into a folder of its own and add library and stamp to the wheel."""
        library = self._folder() / recipe.LIBRARY.name
        compiler = recipe.compile_library(library)
        self._add(recipe, build_data, library, library.name)
        self._stamp(recipe, build_data, f"{recipe.digest()}\n{compiler}\n")

    def _go_on_without(self, recipe: ModuleType, version: str, build_data: dict[str, Any], error: RuntimeError) -> None:
        if os.environ.get("MINSNAP_REQUIRE_NATIVE", "") not in ("", "0"):
            raise error
        print(f"WARNING: minsnap is installed without its native core, and is slower: {error}", file=sys.stderr)
        if version != "editable":
            self._stamp(recipe, build_data, f"-\n{str(error).splitlines()[0]}\n")

    def _stamp(self, recipe: ModuleType, build_data: dict[str, Any], text: str) -> None:
        stamp = self._folder() / recipe.STAMP.name
        stamp.write_text(text, encoding="utf-8")
        self._add(recipe, build_data, stamp, stamp.name)

    def _folder(self) -> Path:
        if not hasattr(self, "_temporary"):
            self._temporary = tempfile.TemporaryDirectory()
        return Path(self._temporary.name)

    @staticmethod
    def _add(recipe: ModuleType, build_data: dict[str, Any], file: Path, name: str) -> None:
        build_data["force_include"][str(file)] = f"minsnap/native/{name}"


def _recipe(root: Path) -> ModuleType:
    """Load build.py by its path: the package itself is not installed yet."""
    spec = importlib.util.spec_from_file_location("minsnap_native_build", root / "minsnap" / "native" / "build.py")
    if spec is None or spec.loader is None:
        raise FileNotFoundError(f"{root} holds no minsnap/native/build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _platform() -> str:
    """Tag of this machine; on Linux the one that promises nothing about other distributions."""
    tags = list(platform_tags())
    return next((tag for tag in tags if tag.startswith("linux_")), tags[0])
