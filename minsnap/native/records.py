"""The structs that entry points take: the ctypes of ``src/basics/border.hpp``."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from ctypes import CFUNCTYPE, POINTER, Structure, c_char_p, c_double, c_int64, c_void_p
from functools import cache, partial
from typing import Any, ClassVar

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import NativeCoreError

Layout = dict[str, dict[str, tuple[int, int]]]
"""Offset and size of each field, by record and name."""

BOOLEANS, INTEGERS, NUMBERS = (np.uint8, np.bool_), (np.int64,), (np.float64,)


class Layouted(Structure):
    """A struct of the border, made from numbers and addresses; who makes it keeps alive what stands there."""

    @classmethod
    def check(cls, library: ctypes.CDLL) -> None:
        """Compare the layout with that of a library.

        Raises
        ------
        NativeCoreError
            If names, offsets or sizes differ.
        """
        own = {name: (getattr(cls, name).offset, getattr(cls, name).size) for name, *_ in cls._fields_}
        declared = layout(library).get(cls.__name__)
        if own != declared:
            raise NativeCoreError(
                f"the native core has another {cls.__name__} than this minsnap: compile it anew with "
                "'python -m minsnap.native.build', or set MINSNAP_CORE=python"
            )


class Record(Layouted):
    """A struct of the border, made from numbers, other records, and arrays that it keeps alive.

    Parameters
    ----------
    **values
        Fields by name. Arrays are C-contiguous and of the kind that ``arrays`` says; None for no array.
    """

    arrays: ClassVar[Mapping[str, tuple[Any, ...]]] = {}

    def __init__(self, **values: Any) -> None:
        super().__init__()
        self.kept: dict[str, Any] = {}
        self.put(**values)

    def put(self, **values: Any) -> None:
        """Set further fields."""
        self.kept |= values
        for name, value in values.items():
            kinds = self.arrays.get(name)
            if kinds is not None and value is not None:
                if value.dtype.type not in kinds or not value.flags.c_contiguous:
                    wanted = f"{type(self).__name__}.{name} takes a contiguous array of {kinds[0].__name__}"
                    raise TypeError(f"{wanted}, not of {value.dtype}")
                value = value.ctypes.data
            setattr(self, name, value)


@cache
def layout(library: ctypes.CDLL) -> Layout:
    """Return where the fields of all records lie in a library."""
    names, place, layouts = (c_char_p * 2)(), (c_int64 * 2)(), Layout()
    index = 0
    while library.minsnap_border_field(c_int64(index), names, place) == 0:
        record, name = (text.decode() for text in names if text is not None)
        layouts.setdefault(record, {})[name] = (place[0], place[1])
        index += 1
    return layouts


def fields(kind: Any, *names: str) -> list[tuple[str, Any]]:
    """Return fields of one kind."""
    return [(name, kind) for name in names]


_integers, _floats, _arrays = (partial(fields, kind) for kind in (c_int64, c_double, c_void_p))


class WallsRecord(Record):
    """Walls on pieces; see ``WallArrays``."""

    _fields_ = (
        *_integers("count", "balls"),
        *_arrays("piece", "order", "normal", "anchor", "bound", "width", "when", "ball", "matrix"),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("piece", "order", "when", "ball"), INTEGERS),
        **dict.fromkeys(("normal", "anchor", "bound", "width", "matrix"), NUMBERS),
    }


class CorridorRecord(Record):
    """A chain of pieces inside walls; see ``CorridorQuestion``."""

    _fields_ = (
        *_integers("half", "pieces", "dim", "continuity", "closed"),
        *_floats("length", "time", "gap", "effort", "seconds"),
        *_arrays("positions", "durations", "pinned", "values"),
        ("walls", WallsRecord),
    )
    arrays: ClassVar = {"pinned": BOOLEANS, **dict.fromkeys(("positions", "durations", "values"), NUMBERS)}


class CorridorAnswerRecord(Record):
    """Where an answer is written; see ``CorridorAnswer``."""

    _fields_ = (
        *_arrays("points", "knots", "wall", "s", "multiplier", "direction"),
        *_floats("cost", "bound", "share", "work"),
        *_integers("rows", "rounds", "attempts"),
    )
    arrays: ClassVar = {"wall": INTEGERS, **dict.fromkeys(("points", "knots", "s", "multiplier", "direction"), NUMBERS)}


class SlackRecord(Record):
    """Slacks of walls, and where they are written; see ``least_slack``."""

    _fields_ = (*_integers("count"), *_arrays("group", "weight", "slack", "remainder"))
    arrays: ClassVar = {"group": INTEGERS, **dict.fromkeys(("weight", "slack", "remainder"), NUMBERS)}


class ChainRecord(Record):
    """A chain of legs without walls; see ``chain_record``."""

    _fields_ = (
        *_integers("half", "legs", "dim", "pins", "closed"),
        *_arrays("points", "durations", "start", "end", "knots", "masks", "values"),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("points", "durations", "start", "end", "values"), NUMBERS),
        **{"knots": INTEGERS, "masks": (np.uint32,)},
    }


class SplitRecord(Record):
    """A search for the durations of legs that cost least, and where it writes what it finds."""

    _fields_ = (
        *_integers("legs", "per_leg", "capacity"),
        *_floats("price", "seconds"),
        *_arrays("durations", "history"),
        *_integers("evaluations"),
    )
    arrays: ClassVar = dict.fromkeys(("durations", "history"), NUMBERS)


class ManyRecord(Record):
    """Many problems, one after the other, and where their answers are written; see ``many_record``."""

    _fields_ = (
        *_integers("count", "dim", "half", "threads"),
        *_floats("gap", "most_gap"),
        *_arrays("points", "durations", "offsets", "widths", "starts", "ends"),
        *_arrays("curves", "breaks", "costs", "figures", "slopes", "displacements", "width_slopes", "statuses"),
    )
    arrays: ClassVar = {
        **dict.fromkeys((field[0] for field in _fields_ if field[1] is c_void_p), NUMBERS),
        **{"offsets": INTEGERS, "statuses": (np.int32,)},
    }


class ExcessRecord(Record):
    """Walls on a derivative of a curve, and the greatest excess over them; see ``MeasuredWalls``."""

    _fields_ = (
        *_integers("pieces", "degree", "dim", "order", "per_leg", "walls", "rows"),
        *_arrays("points", "durations", "leg", "matrix", "anchor", "lower", "upper"),
        *_floats("attained", "bound", "where"),
        *_integers("row"),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("points", "durations", "matrix", "anchor", "lower", "upper"), NUMBERS),
        **{"leg": INTEGERS},
    }


class ValuesRecord(Record):
    """Curves and where their derivatives at instants are written; see ``many_values``."""

    _fields_ = (
        *_integers("count", "degree", "dim", "order", "instants", "shared", "threads"),
        *_arrays("points", "durations", "breaks", "offsets", "present", "t", "values", "statuses"),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("points", "durations", "breaks", "t", "values"), NUMBERS),
        **{"offsets": INTEGERS, "present": BOOLEANS, "statuses": (np.int32,)},
    }


class VehicleRecord(Record):
    """A vehicle on parts of a path, and where their bounds are written; see ``vehicle_bounds``."""

    _fields_ = (
        *_integers("parts", "count"),
        *_floats("mass", "jerk"),
        *_arrays("medium", "inertia", "mixer", "points", "half", "yaw", "axes", "bounds"),
    )
    arrays: ClassVar = dict.fromkeys(("medium", "inertia", "mixer", "points", "half", "yaw", "axes", "bounds"), NUMBERS)


class SetsRecord(Record):
    """Sets of half-spaces, and where their largest balls or their reach are written; see ``half_space_sets.py``."""

    _fields_ = (
        *_integers("sets", "dim", "ways"),
        *_floats("far"),
        *_arrays("first", "normals", "bounds", "along", "centers", "radii", "least"),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("normals", "bounds", "along", "centers", "radii", "least"), NUMBERS),
        **{"first": INTEGERS},
    }


class PieceRecord(Record):
    """One polynomial from a moving state, and conditions at instants; see ``piece_programme.py``."""

    _fields_ = (
        *_integers("half", "dim", "conditions", "free"),
        *_floats("duration", "acceleration"),
        *_arrays("order", "soft", "first", "s", "ahead", "matrix", "bound", "ends", "points"),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("order", "soft", "first"), INTEGERS),
        **dict.fromkeys(("s", "ahead", "matrix", "bound", "ends", "points"), NUMBERS),
    }


POLL = CFUNCTYPE(c_int64, c_double, c_int64)
"""Called during a search; not 0 ends it."""


class ConeGroup(Record):
    """Sets that a derivative stays in, in a search for the shortest time and in stops; see :meth:`of`."""

    _fields_ = (
        *_integers("count", "rows", "order", "outside", "at_knots"),
        *_arrays("leg", "matrix", "anchor", "slope", "radius", "width"),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("matrix", "anchor", "slope", "radius", "width"), NUMBERS),
        **{"leg": INTEGERS},
    }

    @classmethod
    def of(cls, leg: IntArray, matrix: FloatArray, *others: FloatArray, **kind: int) -> ConeGroup:
        """Return sets: norm of A (x - a) <= radius + slope . (x - a), in the form of ``Walls``.

        Parameters
        ----------
        leg : ndarray of int, shape (m,)
            Or waypoints with ``at_knots``.
        matrix : ndarray, shape (m, q, dim)
        *others : ndarray
            Anchors and slopes (m, dim), radii and widths (m,).
        **kind
            Which derivative ``order`` is, whether sets are ``at_knots``, and whether the norm must be at least the
            radius instead, ``outside``; then without slope.
        """
        numbers = (np.ascontiguousarray(one, dtype=np.float64) for one in (matrix, *others))
        arrays = dict(zip(("matrix", "anchor", "slope", "radius", "width"), numbers, strict=True))
        return cls(
            count=len(leg), rows=matrix.shape[1], leg=np.ascontiguousarray(leg, dtype=np.int64), **arrays, **kind
        )

    def changed(self, **values: Any) -> ConeGroup:
        """Return the same with other fields."""
        return ConeGroup(**self.kept | values)


class StopRecord(Record):
    """A way to come to rest inside walls; see ``stops.py``."""

    _fields_ = (
        *_integers("half", "dim", "walls", "limits", "legs", "member"),
        *_floats("unit"),
        *_arrays("state", "waypoints"),
        ("cones", POINTER(ConeGroup)),
        *_arrays("caps", "points"),
        *_floats("duration", "change"),
        *_integers("limited"),
    )
    arrays: ClassVar = dict.fromkeys(("state", "waypoints", "caps", "points"), NUMBERS)


class MomentaryLimit(Record):
    """A limit on several derivatives at an instant, in such a search."""

    _fields_ = (*_integers("kind"), *_arrays("parameters"))
    arrays: ClassVar = {"parameters": NUMBERS}


class ShortestRequest(Record):
    """A search for the shortest time; see ``src/shortest_time/border.hpp``."""

    _fields_ = (
        *_integers("half", "dim", "legs", "closed", "groups", "limits", "divisions", "moving", "rough"),
        *_arrays("parts"),
        *_floats("worthwhile", "inwards", "tightened"),
        *_arrays("pinned", "free", "lengths", "norms"),
        *_floats("price", "slower"),
        *_integers("guessed"),
        *_arrays("guess_durations", "guess_knots", "least", "turned"),
        ("cones", POINTER(ConeGroup)),
        ("momentary", POINTER(MomentaryLimit)),
        ("poll", POLL),
    )
    arrays: ClassVar = {
        **dict.fromkeys(("pinned", "lengths", "norms", "turned"), NUMBERS),
        **dict.fromkeys(("guess_durations", "guess_knots", "least"), NUMBERS),
        **{"parts": INTEGERS, "free": INTEGERS},
    }

    @classmethod
    def check(cls, library: ctypes.CDLL) -> None:
        """Compare the layouts of what it points to as well."""
        super().check(library)
        ConeGroup.check(library)
        MomentaryLimit.check(library)


class ShortestAnswer(Record):
    """Where a search for the shortest time writes what it finds."""

    _fields_ = (
        *_integers("pieces", "iterations"),
        *_floats("total", "wall", "limit"),
        *_arrays("durations", "points", "knots"),
    )
    arrays: ClassVar = dict.fromkeys(("durations", "points", "knots"), NUMBERS)
