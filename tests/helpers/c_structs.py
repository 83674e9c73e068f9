"""The structs of a C header as ctypes has them, read from its text: their fields are declared there alone."""

import ctypes
import re
from pathlib import Path

NUMBERS = {"int64_t": ctypes.c_int64, "double": ctypes.c_double}


def structs_of(header: Path) -> dict[str, type[ctypes.Structure]]:
    """Return the structs of a header by name; pointers are addresses."""
    text = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.DOTALL)
    found: dict[str, type[ctypes.Structure]] = {}
    for name, body in re.findall(r"typedef struct (\w+) \{(.*?)\} \1;", text, flags=re.DOTALL):
        fields = [field for line in body.split(";") if line.strip() for field in _fields(line.strip())]
        found[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
    return found


def _fields(line: str) -> list[tuple[str, type]]:
    function = re.fullmatch(r"int64_t \(\*(\w+)\)\(void \*\w*\)", line)
    if function:
        return [(function[1], ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p))]
    kind, names = re.fullmatch(r"(?:const )?(\w+) (.+)", line, flags=re.DOTALL).groups()
    return [_field(kind, name.strip()) for name in names.split(",")]


def _field(kind: str, name: str) -> tuple[str, type]:
    if name.startswith("*"):
        return name[1:], ctypes.c_void_p
    name, *count = re.split(r"[\[\]]", name)[:2]
    return name, NUMBERS[kind] * int(count[0]) if count else NUMBERS[kind]
