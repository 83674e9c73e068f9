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


class Array(c_void_p):
    """Where an array of a record lies."""

    holds: ClassVar[tuple[Any, ...]] = ()
    """Kinds of its numbers."""


class Record(Structure):
    """A struct of the border, made from numbers, other records, and arrays that it keeps alive.

    Parameters
    ----------
    **values
        Fields by name. Arrays are C-contiguous and of the kind that their field holds; None for no array.
    """

    arrays: ClassVar[Mapping[str, tuple[Any, ...]]] = {}

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.arrays = {name: kind.holds for name, kind, *_ in cls._fields_ if issubclass(kind, Array)}

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


ARRAYS = (np.float64,), (np.int64,), (np.int32,), (np.uint32,), (np.uint8, np.bool_)
"""Kinds of numbers in each kind of array."""

_integers, _floats = (partial(fields, kind) for kind in (c_int64, c_double))
_numbers, _indices, _statuses, _masks, _flags = (
    partial(fields, type("Array", (Array,), {"holds": kinds})) for kinds in ARRAYS
)


class WallsRecord(Record):
    """Walls on pieces; see ``WallArrays``."""

    _fields_ = (
        *_integers("count", "balls"),
        *_indices("piece", "order"),
        *_numbers("normal", "anchor", "bound", "width"),
        *_indices("when", "ball"),
        *_numbers("matrix"),
    )


class CorridorRecord(Record):
    """A chain of pieces inside walls; see ``CorridorQuestion``."""

    _fields_ = (
        *_integers("half", "pieces", "dim", "continuity", "closed"),
        *_floats("length", "time", "gap", "effort", "seconds"),
        *_numbers("positions", "durations"),
        *_flags("pinned"),
        *_numbers("values"),
        ("walls", WallsRecord),
    )


class CorridorAnswerRecord(Record):
    """Where an answer is written; see ``CorridorAnswer``."""

    _fields_ = (
        *_numbers("points", "knots"),
        *_indices("wall"),
        *_numbers("s", "multiplier", "direction"),
        *_floats("cost", "bound", "share", "work"),
        *_integers("rows", "rounds", "attempts"),
    )


class SlackRecord(Record):
    """Slacks of walls, and where they are written; see ``least_slack``."""

    _fields_ = (*_integers("count"), *_indices("group"), *_numbers("weight", "slack", "remainder"))


class ChainRecord(Record):
    """A chain of legs without walls; see ``chain_record``."""

    _fields_ = (
        *_integers("half", "legs", "dim", "pins", "closed"),
        *_numbers("points", "durations", "start", "end"),
        *_indices("knots"),
        *_masks("masks"),
        *_numbers("values"),
    )


class SplitRecord(Record):
    """A search for the durations of legs that cost least, and where it writes what it finds."""

    _fields_ = (
        *_integers("legs", "per_leg", "capacity"),
        *_floats("price", "seconds", "effort"),
        *_numbers("durations", "history"),
        *_integers("evaluations"),
        *_floats("work"),
    )


class ManyRecord(Record):
    """Many problems, one after the other, and where their answers are written; see ``many_record``."""

    _fields_ = (
        *_integers("count", "dim", "half", "threads"),
        *_floats("gap", "most_gap"),
        *_numbers("points", "durations"),
        *_indices("offsets"),
        *_numbers("widths", "starts", "ends"),
        *_numbers("curves", "breaks", "costs", "figures", "slopes", "displacements", "width_slopes"),
        *_statuses("statuses"),
    )


class ExcessRecord(Record):
    """Walls on a derivative of a curve, and the greatest excess over them; see ``MeasuredWalls``."""

    _fields_ = (
        *_integers("pieces", "degree", "dim", "order", "per_leg", "walls", "rows"),
        *_numbers("points", "durations"),
        *_indices("leg"),
        *_numbers("matrix", "anchor", "lower", "upper"),
        *_floats("attained", "bound", "where"),
        *_integers("row"),
    )


class ValuesRecord(Record):
    """Curves and where their derivatives at instants are written; see ``many_values``."""

    _fields_ = (
        *_integers("count", "degree", "dim", "order", "instants", "shared", "threads"),
        *_numbers("points", "durations", "breaks"),
        *_indices("offsets"),
        *_flags("present"),
        *_numbers("t", "values"),
        *_statuses("statuses"),
    )


class VehicleRecord(Record):
    """A vehicle on parts of a path, and where their bounds are written; see ``vehicle_bounds``."""

    _fields_ = (
        *_integers("parts", "count"),
        *_floats("mass", "jerk"),
        *_numbers("medium", "inertia", "mixer", "points", "half", "yaw", "axes", "bounds"),
    )


class SetsRecord(Record):
    """Sets of half-spaces, and where their largest balls or their reach are written; see ``half_space_sets.py``."""

    _fields_ = (
        *_integers("sets", "dim", "ways"),
        *_floats("far"),
        *_indices("first"),
        *_numbers("normals", "bounds", "along", "centers", "radii", "least"),
    )


class PieceRecord(Record):
    """One polynomial from a moving state, and conditions at instants; see ``piece_programme.py``."""

    _fields_ = (
        *_integers("half", "dim", "conditions", "free"),
        *_floats("duration", "acceleration"),
        *_indices("order", "soft", "first"),
        *_numbers("s", "ahead", "matrix", "bound", "ends", "points"),
    )


POLL = CFUNCTYPE(c_int64, c_double, c_int64)
"""Called during a search; not 0 ends it."""


class ConeGroup(Record):
    """Sets that a derivative stays in, in a search for the shortest time and in stops; see :meth:`of`."""

    _fields_ = (
        *_integers("count", "rows", "order", "outside", "at_knots"),
        *_indices("leg"),
        *_numbers("matrix", "anchor", "slope", "radius", "width"),
    )

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
        *_numbers("state", "waypoints"),
        ("cones", POINTER(ConeGroup)),
        *_numbers("caps", "points"),
        *_floats("duration", "change"),
        *_integers("limited"),
    )


class MomentaryLimit(Record):
    """A limit on several derivatives at an instant, in such a search."""

    _fields_ = (*_integers("kind"), *_numbers("parameters"))


class ShortestRequest(Record):
    """A search for the shortest time; see ``src/shortest_time/border.hpp``."""

    _fields_ = (
        *_integers("half", "dim", "legs", "closed", "groups", "limits", "divisions", "moving", "rough"),
        *_indices("parts"),
        *_floats("worthwhile", "inwards", "tightened"),
        *_numbers("pinned"),
        *_indices("free"),
        *_numbers("lengths", "norms"),
        *_floats("price", "slower"),
        *_integers("guessed"),
        *_numbers("guess_durations", "guess_knots", "least", "turned"),
        ("cones", POINTER(ConeGroup)),
        ("momentary", POINTER(MomentaryLimit)),
        ("poll", POLL),
    )

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
        *_numbers("durations", "points", "knots"),
    )
