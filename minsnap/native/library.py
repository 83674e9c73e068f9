"""Loads the compiled core and says which core runs.

``MINSNAP_CORE`` chooses: ``auto`` (the default) takes the native core if it is there, ``python`` never takes it,
``native`` raises NativeCoreError where it is missing.  ``MINSNAP_LIBRARY`` names another library than the installed
one, such as one compiled with sanitizers.

How to add an area ``xyz``:

1. A source in a folder of ``src`` holds its entry points, ``MINSNAP_EXPORT std::int32_t minsnap_xyz(...)``: plain
   integers, doubles and pointers to contiguous arrays in, a ``Status`` out.  Sizes are checked against their bounds
   before anything is allocated, memory comes from ``Buffer``, no exception is thrown, nothing global is kept.
   The build takes every source there; run ``python -m minsnap.native.build``.
2. ``xyz.py`` beside this file wraps them.  It declares each entry point at module level and calls it::

       _SOLVE = Entry("minsnap_xyz", c_int64, c_void_p, c_void_p)

       status = Status(_SOLVE(len(a), address(a), address(b)))  # UNSUPPORTED where the Python core has to answer

   Arrays must be C-contiguous float64; ``address`` refuses others. More than a few arguments are a ``Record``: a struct
   as in ``src/basics/border.hpp``, listed in ``src/basics/library.cpp`` and named in ``records.py``.
3. A change of the arguments of an entry point raises ``ABI`` here and in ``include/minsnap.h``.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

from minsnap.errors import MinsnapError
from minsnap.native.build import LIBRARY, STAMP
from minsnap.native.status import Status

KINDS = "dlqLQiIB?"
"""Characters of the kinds of arrays that entry points take: float64, integers and booleans."""

FEW = 1 << 14
"""Bytes that are copied faster than the address of an array is read."""

ABI = 23
"""What ``minsnap_abi`` of a matching library returns."""

CHOICES = ("auto", "native", "python")

Function = Callable[..., int]


class NativeCoreError(MinsnapError):
    """The native core is missing and ``MINSNAP_CORE=native`` demands it, or it is older than the package."""


@dataclass(frozen=True)
class Core:
    """Which core answers.

    Parameters
    ----------
    library : ctypes.CDLL or None
        The native core; None where the Python core answers.
    reason : str
        Why it is the Python core, and what to do; empty for the native one.
    """

    library: ctypes.CDLL | None
    reason: str = ""

    @property
    def name(self) -> str:
        """``"native"`` or ``"python"``."""
        return "python" if self.library is None else "native"


@cache
def loaded() -> Core:
    """Load the library, once a process."""
    path = os.environ.get("MINSNAP_LIBRARY", "") or str(LIBRARY)
    if not os.path.exists(path):
        return Core(None, _why_missing(path))
    try:
        _refuse_cut(path)
        library = ctypes.CDLL(path)
        abi = int(library.minsnap_abi())
    except (OSError, AttributeError) as error:
        return Core(None, f"the native core is damaged or of another machine ({error}): install minsnap again")
    if abi != ABI:
        return Core(None, f"the native core has interface {abi}, not {ABI}: run python -m minsnap.native.build")
    library.minsnap_compiler.restype = ctypes.c_char_p
    library.minsnap_status_name.restype = ctypes.c_char_p
    return Core(library)


def _why_missing(path: str) -> str:
    if path != str(LIBRARY):
        return f"MINSNAP_LIBRARY is {path}, which does not exist: name another library, or none"
    lines = STAMP.read_text(encoding="utf-8", errors="replace").splitlines() if STAMP.exists() else []
    left_out = len(lines) > 1 and lines[0] == "-"
    reason = lines[1] if left_out else f"{path} is missing"
    advised = ": " in reason
    return reason if advised else f"{reason}: run python -m minsnap.native.build, or install minsnap again"


def _refuse_cut(path: str) -> None:
    """Raise an OSError if the end of an ELF file is missing, since loading it would kill the process."""
    with open(path, "rb") as file:
        head = file.read(64)
    wide = head.startswith(b"\x7fELF\x02\x01") and len(head) == 64  # 64 bits, as all that are released
    table, size, count = (int.from_bytes(head[at:end], "little") for at, end in ((40, 48), (58, 60), (60, 62)))
    if wide and table + size * count > os.path.getsize(path):
        raise OSError(f"{path}: its end is missing")


class _Choice:
    """The core in use; chosen by the environment at the first question."""

    core: Core | None = None


def core() -> Core:
    """Return the core in use.

    Raises
    ------
    NativeCoreError
        If ``MINSNAP_CORE`` is ``native`` and there is none, or is not one of ``CHOICES``.
    """
    if _Choice.core is None:
        _Choice.core = _chosen(os.environ.get("MINSNAP_CORE", "") or "auto")
    return _Choice.core


def _chosen(choice: str) -> Core:
    if choice not in CHOICES:
        raise NativeCoreError(f"MINSNAP_CORE is {choice!r}: it must be one of {', '.join(CHOICES)}")
    if choice == "python":
        return Core(None, "MINSNAP_CORE=python was asked for")
    core = loaded()
    if choice == "native" and core.library is None:
        raise NativeCoreError(f"MINSNAP_CORE is native, but {core.reason}")
    return core


@contextmanager
def using(choice: str) -> Iterator[Core]:
    """Use another core for a while, in all threads: ``with using("python"):``, for comparisons."""
    before, chosen = _Choice.core, _chosen(choice)
    _choose(chosen)
    try:
        yield chosen
    finally:
        _choose(before)


def _choose(chosen: Core | None) -> None:
    _Choice.core = chosen
    for entry in Entry.every:
        entry.ready = None


class Entry:
    """An entry point of the library, looked up when it is first needed.

    Parameters
    ----------
    name : str
    *types
        ctypes of the arguments; without them callers pass ctypes values, and integers of 32 bits.

    Attributes
    ----------
    ready : callable or None
        The function once it was looked up, for callers in a hurry: ``entry.ready or entry.function()``.
    """

    __slots__ = ("name", "ready", "types")
    every: ClassVar[list[Entry]] = []

    def __init__(self, name: str, *types: Any) -> None:
        self.name = name
        self.types = types
        self.ready: Function | None = None
        Entry.every.append(self)

    def function(self) -> Function | None:
        """Return the function, or None where the Python core is in use.

        Raises
        ------
        NativeCoreError
            If the library was compiled from older sources, which do not have it.
        """
        library = core().library
        if library is not None and self.ready is None:
            function = getattr(library, self.name, None)
            if function is None:
                raise NativeCoreError(
                    f"the native core is older than this minsnap, and has no {self.name}: compile it anew with "
                    "'python -m minsnap.native.build', or set MINSNAP_CORE=python"
                )
            records = ctypes.Structure  # which are passed by reference
            passed = [ctypes.POINTER(kind) if issubclass(kind, records) else kind for kind in self.types]
            function.argtypes, function.restype = passed or None, ctypes.c_int32
            self.ready = function
        return self.ready

    def __call__(self, *arguments: Any) -> int:
        """Return the status with which the function ends; ``UNSUPPORTED`` where the Python core is in use."""
        function = self.ready or self.function()
        return Status.UNSUPPORTED if function is None else function(*arguments)


def writable(array: Any) -> Any:
    """Return the address of the first value of a C-contiguous array that is writable and not empty, the fastest way."""
    return ctypes.byref(ctypes.c_char.from_buffer(array))


def address(array: Any) -> Any:
    """Return the address of the first value of any C-contiguous array, in the form that costs least to pass.

    Raises
    ------
    TypeError
        If the array is not contiguous, or of a kind that no entry point takes.
    """
    flags = array.flags
    if array.dtype.char not in KINDS or not flags.c_contiguous:
        raise TypeError(f"the native core takes contiguous float64 or integers, not {array.dtype} of {array.strides}")
    return writable(array) if flags.writeable and array.size else ctypes.c_void_p(array.ctypes.data)


def readable(array: Any) -> Any:
    """Return what the native core only reads, in the form that costs least to pass: a copy of few numbers.

    Raises
    ------
    TypeError
        As :func:`address`.
    """
    return array.tobytes() if array.nbytes <= FEW and array.dtype.char in KINDS else address(array)


def optional_address(array: Any) -> Any:
    """Return the same, or None for no array."""
    return None if array is None else address(array)


def describe() -> str:
    """Say in one line which core runs and, if it is the Python one, why and how to get the faster one."""
    now = core()
    if now.library is None:
        return f"python core: {now.reason}"
    return f"native core, compiled by {_compiler(now.library)}"


def _compiler(library: ctypes.CDLL) -> str:
    return str(library.minsnap_compiler().decode())
