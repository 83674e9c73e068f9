"""The public names of a package: loaded when they are first used, and told in a sentence what they do not take."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, wraps
from types import FunctionType
from typing import Any

import lazy_loader

FOREIGN = {"scipy": "SciPy", "qpsolvers": "qpsolvers", "cflib": "cflib", "usb": "the USB library"}
"""Packages whose own exceptions leave no public call, and their names."""

MOST_SAID, DEEPEST = 120, 3
"""Letters that are told of another package's words; how deep tensors are looked for in lists of arguments."""

Loaded = tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]


def public_names(package: str, file: str) -> Loaded:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package, from the stub beside its file.

    A call of what it loads raises InputError where it would fail in Python's own way because an argument is not of the
    kind of its annotation.
    """
    load, names, public = lazy_loader.attach_stub(package, file)

    def loaded(name: str) -> Any:
        found = load(name)
        if str(getattr(found, "__module__", "")).startswith("minsnap.") and callable(found):
            found = vars(sys.modules[package])[name] = _checked_whole(found)
            for returned in re.findall(r"\w+", str(getattr(found, "__annotations__", {}).get("return", ""))):
                if returned in public:
                    _checked_whole(load(returned))
        return found

    return loaded, names, public


def _checked_whole(called: Any) -> Any:
    """Return a function, or a class with its public methods, that refuses what it cannot take."""
    if not isinstance(called, type):
        return _checked(called) if isinstance(called, FunctionType) else called
    for kind in called.__mro__:
        for name, method in list(vars(kind).items()) if kind.__module__.startswith("minsnap.") else ():
            if name in ("__init__", "__call__") or not name.startswith("_"):
                if isinstance(method, FunctionType):
                    type.__setattr__(kind, name, _checked(method))
                elif isinstance(method, classmethod | staticmethod):
                    type.__setattr__(kind, name, type(method)(_checked(method.__func__)))
    return called


@cache
def _checked(target: Any) -> Any:
    """Return a function that refuses what it cannot take."""
    if hasattr(target, "refuses"):
        return target

    @wraps(target)
    def checked(*args: Any, **kwargs: Any) -> Any:
        try:
            return target(*args, **kwargs)
        except Exception as error:
            told = _told(target, args, kwargs, error)
            if told is None:
                raise
            raise told from (error if told.__class__.__name__ == "SolverError" else None)

    checked.refuses = True  # type: ignore[attr-defined]
    if target.__qualname__ == target.__name__:
        setattr(sys.modules[target.__module__], target.__name__, checked)  # where a pickle finds it
    return checked


def _told(target: Callable[..., Any], args: Any, kwargs: Any, error: Exception) -> Exception | None:
    """Return what an exception of a call is told as: the library's own, or None where it is to leave as it is."""
    from minsnap.errors import InputError, MinsnapError, SolverError

    name = target.__qualname__.removesuffix(".__init__")
    if isinstance(error, MinsnapError):
        return None
    home = type(error).__module__.partition(".")[0]
    if isinstance(error, RuntimeError) and (argument := _with_gradient(target, args, kwargs)) is not None:
        return InputError(
            f"{name} takes numbers for {argument}, and this is a tensor with gradients: give {argument}.detach()"
        )
    if isinstance(error, (AttributeError, LookupError, OverflowError, ValueError)):
        other = _of_other_kind(target, args, kwargs)
        if other is not None:
            return InputError(f"{name} takes {other}")
    if home in FOREIGN:
        said = f"{error}".strip().partition("\n")[0] or type(error).__name__
        return SolverError(f"{name} cannot be done with these values: {FOREIGN[home]} says {said[:MOST_SAID]!r}")
    return None


def _with_gradient(target: Callable[..., Any], args: Any, kwargs: Any) -> str | None:
    """Return the name of an argument that is a tensor whose gradients are followed, or holds one."""
    from inspect import signature

    def followed(value: Any, depth: int = 0) -> bool:
        if getattr(value, "requires_grad", False) is True:
            return True
        parts = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
        return depth < DEEPEST and any(followed(part, depth + 1) for part in parts)

    named = signature(target).bind(*args, **kwargs).arguments
    return next((name for name, value in named.items() if followed(value)), None)


def _of_other_kind(target: Callable[..., Any], args: Any, kwargs: Any) -> str | None:
    """Say which argument is not of the kind of its annotation; None where all may be."""
    from inspect import signature

    from minsnap.basics.messages import shown

    for name, value in signature(target).bind(*args, **kwargs).arguments.items():
        annotation = target.__annotations__.get(name, "Any")
        if not _may_be(value, annotation):
            return f"{annotation} for {name}, not {shown(value)}"
    return None


def _may_be(value: Any, annotation: str) -> bool:
    """Whether a value, with its elements, may be of the kinds that an annotation names."""
    from minsnap.basics.arrays import numbers

    if isinstance(value, int) and "int" not in annotation and value.bit_length() > sys.float_info.max_exp:
        return False
    outer = annotation
    while "[" in outer:
        outer = re.sub(r"\[[^\[\]]*\]", "", outer)
    if "ArrayLike" in outer and value is not None and numbers(value, copy=False) is not None:
        return True
    elements = value if isinstance(value, list | tuple) else ()
    inner = tuple(_kinds(f"{annotation} Iterable"))
    return isinstance(value, tuple(_kinds(outer))) and all(isinstance(one, inner) for one in elements)


def _kinds(annotation: str) -> Iterator[type]:
    """Yield the classes that an annotation names; object where it may be any."""
    import builtins
    from numbers import Real

    import numpy as np
    from scipy import interpolate

    forms: dict[str, tuple[Any, ...]] = {
        "Any": (object,),
        "None": (type(None),),
        "float": (Real,),
        "ArrayLike": (),
        "Mapping": (Mapping,),
    }
    forms |= {"FloatArray": (np.ndarray,), "Sequence": (list, tuple, np.ndarray), "Iterable": (Iterable,)}
    forms |= {"Callable": (Callable,)}
    homes = (builtins, interpolate, *(module for name, module in sys.modules.items() if name.startswith("minsnap.")))
    for name in set(re.findall(r"[A-Za-z_]\w*", annotation)):
        if name in forms:
            yield from forms[name]
            continue
        named = [vars(home)[name] for home in homes if name in vars(home)]  # two modules may mean two classes by it
        for kind in named or [object]:
            told = isinstance(kind, type) and kind is not Any and not getattr(kind, "_is_protocol", False)
            yield kind if told else object
