"""Compile the native core while a wheel is made.

Where no compiler is on the PATH the build installs the package ``ziglang`` beside hatchling, which is one; it goes with
the build's environment.  ``MINSNAP_PURE=1`` leaves the core out; then everything works in Python alone, more slowly.

Every wheel says what is in it besides its Python files: a software bill of materials in CycloneDX, in the folder that
PEP 770 names. It holds no date, so that equal sources and compilers make equal wheels.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
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

    def dependencies(self) -> list[str]:
        """Return what has to be installed before the core can be compiled."""
        return [] if _pure() else _recipe(Path(self.root)).requirements()

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and mark the wheel as one for this platform; end with a sentence where that fails."""
        recipe = _recipe(Path(self.root))
        if version == "editable":
            compile_dir(str(Path(self.root) / "minsnap"), quiet=2)  # an installer does so for the files that it copies
        if _pure():
            self._leave_out(recipe, version, build_data)
            return
        try:
            if version == "editable":
                recipe.build()
            else:
                self._include(recipe, build_data)
        except (recipe.NoCompilerError, recipe.CompilationError) as error:
            sys.exit(f"the native core of minsnap was not compiled: {error}")
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{os.environ.get('MINSNAP_PLATFORM') or _platform()}"

    def _include(self, recipe: ModuleType, build_data: dict[str, Any]) -> None:
        """Compile into a folder of its own and add library and stamp to the wheel."""
        library = self._folder() / recipe.LIBRARY.name
        compiler = recipe.compile_library(library)
        self._add(build_data, library)
        self._stamp(recipe, build_data, f"{recipe.digest()}\n{compiler}\n")
        self._list_materials(recipe, build_data, library, compiler)

    def _leave_out(self, recipe: ModuleType, version: str, build_data: dict[str, Any]) -> None:
        reason = "minsnap was installed with MINSNAP_PURE=1"
        if version == "editable":
            recipe.leave_out(reason)
        else:
            self._stamp(recipe, build_data, f"-\n{reason}\n")
            self._list_materials(recipe, build_data)

    def _list_materials(
        self, recipe: ModuleType, build_data: dict[str, Any], library: Path | None = None, compiler: str = ""
    ) -> None:
        """Add the bill of materials to a wheel; hatchling before 1.28 leaves it out."""
        file = self._folder() / "minsnap.cdx.json"
        content = materials(self.metadata.version, recipe.digest(), library, compiler)
        file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        build_data.setdefault("sbom_files", []).append(str(file))

    def _stamp(self, recipe: ModuleType, build_data: dict[str, Any], text: str) -> None:
        stamp = self._folder() / recipe.STAMP.name
        stamp.write_text(text, encoding="utf-8")
        self._add(build_data, stamp)

    def _folder(self) -> Path:
        if not hasattr(self, "_temporary"):
            self._temporary = tempfile.TemporaryDirectory()
        return Path(self._temporary.name)

    @staticmethod
    def _add(build_data: dict[str, Any], file: Path) -> None:
        build_data["force_include"][str(file)] = f"minsnap/native/{file.name}"


def materials(version: str, sources: str, library: Path | None, compiler: str) -> dict[str, Any]:
    """Return what a wheel is made of, as CycloneDX 1.6 has it.

    Parameters
    ----------
    version : str
    sources : str
        Digest of the sources and flags of the core, SHA-256.
    library : path or None
        The compiled core; None in a wheel without.
    compiler : str
        What compiled it, whose runtime is inside of it.
    """
    package = {"type": "library", "name": "minsnap", "version": version, "purl": f"pkg:pypi/minsnap@{version}"}
    package["bom-ref"] = package["purl"]
    held = {**package, "licenses": [{"license": {"id": "MIT"}}]}
    parts: list[dict[str, Any]] = []
    metadata: dict[str, Any] = {"component": held}
    if library is not None:
        digest = hashlib.sha256(library.read_bytes()).hexdigest()
        core = {"type": "library", "name": "minsnap/native/_core.bin", "version": version, "bom-ref": "core"}
        told = [{"name": "minsnap:sources", "value": sources}]
        parts = [{**core, "hashes": [{"alg": "SHA-256", "content": digest}], "properties": told}]
        metadata["tools"] = {"components": [{"type": "application", "name": compiler}]}
    made_of = [{"ref": package["purl"], "dependsOn": [part["bom-ref"] for part in parts]}]
    schema = "http://cyclonedx.org/schema/bom-1.6.schema.json"
    head = {"$schema": schema, "bomFormat": "CycloneDX", "specVersion": "1.6"}
    return {**head, "version": 1, "metadata": metadata, "components": parts, "dependencies": made_of}


def _pure() -> bool:
    return os.environ.get("MINSNAP_PURE", "") not in ("", "0")


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
