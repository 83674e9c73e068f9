"""The structs that entry points take, laid out by the text that C++ declares them with (``src/basics/record.hpp``)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from ctypes import CFUNCTYPE, POINTER, Structure, byref, c_char_p, c_double, c_int32, c_int64, c_void_p, sizeof
from functools import cache
from threading import RLock
from typing import Any, ClassVar, TypeVar

import numpy as np

from minsnap.native.library import NativeCoreError, loaded

R = TypeVar("R", bound="Record")

POLL = CFUNCTYPE(c_int64, c_void_p)
"""Called during a search with the context of its request; not 0 ends it."""

NUMBERS = {"float64": c_double, "int32": c_int32, "int64": c_int64, "poll": POLL, "context": c_void_p}
"""Kinds of fields that hold neither arrays nor records."""

NAMES = {"double": "float64", "Integer": "int64", "Obstacle": "float64", "Poll": "poll", "void*": "context"}
"""Kinds by what C++ calls them, beside ``std::int64_t`` and the like."""

FIELDS = re.compile(r"(?:const |volatile )?(?:std::)?(\w+?)(?:_t)? ([^;]+);")
"""What fields of one declaration hold, and their names."""


class Record(Structure):
    """A struct of the border, made from numbers, other records, and arrays that it keeps alive.

    It is the struct of its class's name in C++, and has its fields. Where there is no library it has none: it keeps
    what it is made from, and nobody reads it.

    Parameters
    ----------
    **values
        Fields by name; the others are zero, or no array. Arrays are C-contiguous and of the kind that their field
        holds; None for no array. An array of records is a list.

    Raises
    ------
    TypeError
        If the struct has no such field, or if an array is not contiguous or of another kind.
    """

    takes: ClassVar[Mapping[str, Any]] = {}
    """By field, the kinds of its array's numbers, or the record in it; None for no array. Empty before the first."""

    def __new__(cls: type[R], **values: Any) -> R:
        """Lay the struct out before the first one is made."""
        if not cls.takes:
            _lay_out(cls)
        return Structure.__new__(cls)

    def __init__(self, **values: Any) -> None:
        super().__init__()
        self.kept: dict[str, Any] = {}
        self.put(**values)

    def put(self, **values: Any) -> None:
        """Set further fields."""
        self.kept |= values
        takes = self.takes
        if not takes and not border():
            return
        for name, value in values.items():
            try:
                held = takes[name]
            except KeyError:
                advice = "if it is spelt right, compile the native core anew with 'python -m minsnap.native.build'"
                raise TypeError(f"{type(self).__name__} has no field {name!r}: {advice}") from None
            if held is None or value is None:
                pass
            elif not isinstance(held, tuple):
                value = _array_of(held, len(value))(*value)
            elif value.dtype.type in held and value.flags.c_contiguous:
                value = value.ctypes.data
            else:
                wanted = f"{type(self).__name__}.{name} takes a contiguous array of {held[0].__name__}"
                raise TypeError(f"{wanted}, not of {value.dtype}")
            setattr(self, name, value)


@cache
def border() -> dict[str, dict[str, str]]:
    """Return what the fields of all records hold in the library, by record and name; nothing where there is none."""
    return {name: dict(_fields(text)) for name, (text, _) in _told().items()}


@cache
def _told() -> dict[str, tuple[str, int]]:
    """Return the text and the size of every record, as the library tells them."""
    library, texts, size = loaded().library, (c_char_p * 2)(), c_int64()
    records: dict[str, tuple[str, int]] = {}
    while library is not None and library.minsnap_record(c_int64(len(records)), texts, byref(size)) == 0:
        name, text = (text.decode() for text in texts if text is not None)
        records[name] = text, size.value
    return records


def _fields(text: str) -> Iterator[tuple[str, str]]:
    """Yield the name and kind of each field of ``{ const double *start, *end; ... }``; arrays end with a star."""
    for kind, names in FIELDS.findall(text):
        for name in names.split(","):
            held = kind + "*" * name.count("*")
            yield name.strip("* "), NAMES.get(held) or NAMES.get(kind, kind) + held[len(kind) :]


@cache
def _array_of(record: type[Record], count: int) -> Any:
    """Return the type of an array of records, which ctypes makes anew where nobody keeps it."""
    return record * count


_LAYING_OUT = RLock()


def _lay_out(record: type[Record]) -> None:
    """Give a struct its fields, once; other threads wait."""
    with _LAYING_OUT:
        if not record.takes:  # empty again where Ctrl-C came between these two
            known = {name: _field(kind) for name, kind in border().get(record.__name__, {}).items()}
            if "_fields_" not in vars(record):
                record._fields_ = [(name, kind) for name, (kind, _) in known.items()]
            _compare_sizes(record)
            record.takes = {name: taken for name, (_, taken) in known.items()}


def _compare_sizes(record: type[Record]) -> None:
    _, size = _told().get(record.__name__, ("", sizeof(record)))
    if sizeof(record) != size:
        where = f"{record.__name__} has {size} bytes in the library and {sizeof(record)} here"
        raise NativeCoreError(f"{where}: compile the native core anew with 'python -m minsnap.native.build'")


def _field(kind: str) -> tuple[Any, Any]:
    """Return the ctypes of a field that holds a kind, as the library names it, and what it takes."""
    name, star = kind.rstrip("*"), kind.endswith("*")
    record = next((one for one in Record.__subclasses__() if one.__name__ == name), None)
    if record is not None:
        _lay_out(record)
        return (POINTER(record), record) if star else (record, None)
    if not star:
        return NUMBERS[name], None
    return c_void_p, (getattr(np, name), *([np.bool_] if name == "uint8" else ()))


class CorridorRecord(Record):
    """A chain of pieces inside walls; see ``CorridorQuestion``."""


class CorridorAnswerRecord(Record):
    """Where an answer is written; see ``CorridorAnswer``."""


class SlackRecord(Record):
    """Slacks of walls, and where they are written; see ``least_slack``."""


class ChainRecord(Record):
    """A chain of legs without walls; see ``chain_record``."""


class SplitRecord(Record):
    """A search for the durations of legs that cost least, and where it writes what it finds."""


class ManyRecord(Record):
    """Many problems, one after the other, and where their answers are written; see ``ManyChains``."""


class PlansRecord(Record):
    """Many problems within limits, and where their plans are written; see ``plans_within``."""


class ExcessRecord(Record):
    """A curve, and where its greatest excess over walls is written; see ``greatest_excess``."""


class ValuesRecord(Record):
    """Curves and where their derivatives at instants are written; see ``many_values``."""


class VehicleRecord(Record):
    """A vehicle on parts of a path, and where their bounds are written; see ``vehicle_bounds``."""


class VehicleUseRecord(Record):
    """A vehicle along a curve, and where its largest values are written; see ``vehicle_proof.py``."""


class SetsRecord(Record):
    """Sets of half-spaces, and where their largest balls or their reach are written; see ``half_space_sets.py``."""


class PiecewiseCurve(Record):
    """A curve to evaluate; see ``Evaluator``."""


class PieceRecord(Record):
    """One polynomial from a moving state, and conditions at instants; see ``piece_programme.py``."""


class StopRecord(Record):
    """A way to come to rest inside walls; see ``stops.py``."""


class MomentaryLimit(Record):
    """A limit on several derivatives at an instant, in a search for the shortest time."""


class ShortestRequest(Record):
    """A search for the shortest time; see ``src/shortest_time/border.hpp``."""


class ShortestAnswer(Record):
    """Where a search for the shortest time writes what it finds."""


class WallsRecord(Record):
    """Walls of one kind; see ``src/basics/walls_record.hpp``, and ``Walls``, whose form it has."""

    def changed(self, **values: Any) -> WallsRecord:
        """Return the same with other fields."""
        return WallsRecord(**self.kept | values)


class CostateSearch(Record):
    """A search for the costate that bounds the flight time; see ``costate.py``."""


class FleetCurves(Record):
    """Curves of several vehicles; see ``FleetArrays``."""


class SeparationQuestion(Record):
    """Which pairs of a fleet come near each other; see ``near_pairs``."""


class ClearanceQuestion(Record):
    """How near vehicles come to obstacles; see ``clearances``."""


class AssignmentQuestion(Record):
    """Which vehicle flies to which goal; see ``bid_for_goals``."""


class TangentQuestion(Record):
    """Convex sets around the segments of a line of points; see ``tangent_planes``."""


class GridWayQuestion(Record):
    """A way through the free cells of a grid; see ``grid_way``."""


class SightQuestion(Record):
    """What a sensor sees from one place; see ``mark_sight``."""


class JointQuestion(Record):
    """A search for all curves of a fleet; see ``FleetSearch``."""


class JointRun(Record):
    """One run of such a search."""
