"""Messages of ROS 2 from their bytes: CDR (OMG, DDS-XTypes 1.3, section 7.4, version 1), by the text that defines them.

The text is that of ``.msg`` files: a bag has it beside each type, with those of the types within behind lines of ``=``.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.errors import FileError

_NUMBERS = {"bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H"}
_NUMBERS |= {"int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"}
_TEXTS = ("string", "wstring")
_FIELD = re.compile(r"(?P<kind>[\w/]+)(?:<=\d+)?(?P<list>\[(?:<?=?\d*)\])?\s+(?P<name>\w+)\s*(?P<constant>=)?")
_PART = re.compile(r"^MSG:\s*(?P<kind>[\w/]+)\s*$")
_HEADER = 4
_ORDERS = {b"\0\0": ">", b"\0\1": "<"}

ANY = -1
"""Number of elements of a sequence, which its bytes say."""


@dataclass(frozen=True)
class Field:
    """A field of a message.

    Parameters
    ----------
    name : str
    kind : str
        Of a number or a text, else the name of a type, ``package/Type``.
    count : int or None
        Elements of an array, ``ANY`` of a sequence; None of a single value.
    """

    name: str
    kind: str
    count: int | None = None


Types = Mapping[str, tuple[Field, ...]]


def short_name(kind: str) -> str:
    """Return the name of a type without its middle part: ``nav_msgs/Odometry`` of ``nav_msgs/msg/Odometry``."""
    return kind.replace("/msg/", "/")


def parse_definition(kind: str, text: str) -> dict[str, tuple[Field, ...]]:
    """Return the fields of a type and of those within, by their short names.

    Parameters
    ----------
    kind : str
        Such as ``nav_msgs/msg/Odometry``.
    text : str
        Its definition, as a bag has it.

    Raises
    ------
    FileError
        If a line of it is none of a definition.
    """
    types: dict[str, list[Field]] = {}
    name = short_name(kind)
    fields = types.setdefault(name, [])
    for line in text.splitlines():
        words = line.split("#")[0].strip()
        if not words or set(words) == {"="}:
            continue
        if part := _PART.match(words):
            name = short_name(part["kind"])
            fields = types.setdefault(name, [])
            continue
        field = _FIELD.match(words)
        if field is None:
            raise FileError(f"the definition of {kind} has a line that is none: {words[:60]!r}")
        if not field["constant"]:
            fields.append(Field(field["name"], _full(field["kind"], name), _count(field["list"])))
    return {name: tuple(rows) for name, rows in types.items()}


def _full(kind: str, within: str) -> str:
    if kind in _NUMBERS or kind in _TEXTS:
        return kind
    if kind == "Header":
        return "std_msgs/Header"
    return short_name(kind) if "/" in kind else f"{within.rsplit('/', 1)[0]}/{kind}"


def _count(text: str | None) -> int | None:
    if text is None:
        return None
    return int(text[1:-1]) if text[1:-1].isdigit() else ANY


def decode(raw: bytes, kind: str, types: Types) -> dict[str, Any]:
    """Return the values of a message by field; those of types within as dictionaries, of numbers in a row as arrays.

    Parameters
    ----------
    raw : bytes
        With its header of four bytes.
    kind : str
        Short name of its type.
    types : mapping
        As :func:`parse_definition` returns them.

    Raises
    ------
    FileError
        If it is in another encoding, ends early, or a type is not defined.
    """
    order = _ORDERS.get(bytes(raw[:2]))
    if order is None:
        raise FileError(f"a message {kind} is not in CDR")
    try:
        return _Cursor(memoryview(raw)[_HEADER:], order, types).message(kind)
    except KeyError as missing:
        raise FileError(f"the type {missing.args[0]} within {kind} is not defined") from None
    except (struct.error, ValueError):
        raise FileError(f"a message {kind} of {len(raw)} bytes does not fit its definition") from None


class _Cursor:
    """A place in the bytes of a message."""

    def __init__(self, raw: memoryview, order: str, types: Types) -> None:
        self._raw, self._order, self._types, self._at = raw, order, types, 0

    def message(self, kind: str) -> dict[str, Any]:
        return {field.name: self._value(field) for field in self._types[kind]}

    def _value(self, field: Field) -> Any:
        if field.count is None:
            return self._single(field.kind)
        count = int(self._number("I")) if field.count == ANY else field.count
        if field.kind in _NUMBERS:
            return self._numbers(_NUMBERS[field.kind], count)
        if count > len(self._raw):  # each takes a byte at least
            raise ValueError
        return [self._single(field.kind) for _ in range(count)]

    def _single(self, kind: str) -> Any:
        if kind in _NUMBERS:
            return self._number(_NUMBERS[kind])
        return self._text(kind) if kind in _TEXTS else self.message(kind)

    def _aligned(self, size: int) -> None:
        self._at = -(-self._at // size) * size

    def _number(self, code: str) -> Any:
        size = struct.calcsize(code)
        self._aligned(size)
        (value,) = struct.unpack_from(self._order + code, self._raw, self._at)
        self._at += size
        return value

    def _numbers(self, code: str, count: int) -> Any:
        kind = np.dtype(self._order + code)
        if not count:
            return np.zeros(0, kind)
        self._aligned(kind.itemsize)
        values = np.frombuffer(self._raw, kind, count, self._at)
        self._at += count * kind.itemsize
        return values

    def _text(self, kind: str) -> str:
        length = int(self._number("I")) * (1 if kind == "string" else 2)
        raw = bytes(self._raw[self._at : self._at + length])
        if len(raw) < length:
            raise ValueError
        self._at += length
        return raw.rstrip(b"\0").decode("utf-8" if kind == "string" else "utf-16-le", errors="replace")


Decoder = Callable[[bytes], dict[str, Any]]


def decoder(kind: str, definition: str) -> Decoder:
    """Return what decodes messages of a type, such as ``nav_msgs/msg/Odometry``, by its definition."""
    types = parse_definition(kind, definition)
    return lambda raw: decode(raw, short_name(kind), types)
