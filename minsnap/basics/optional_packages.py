"""Packages that extras bring: imported where they are needed, and named where they are missing."""

from importlib import import_module
from typing import Any


def optional(module: str, need: str, extra: str) -> Any:
    """Return a module of a package that is not always there.

    Parameters
    ----------
    module : str
    need : str
        What needs it, such as "reading ULog needs pyulog".
    extra : str
        The extra that brings it.

    Raises
    ------
    ImportError
        If it is not installed.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError:
        raise ImportError(f"{need}: pip install 'minsnap[{extra}]'") from None
