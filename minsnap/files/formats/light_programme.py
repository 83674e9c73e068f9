"""Colours of a vehicle's lamp over time, and Skybrush's bytecode of them.

A command is a byte and its arguments; a duration is a varint of 20 ms. Written are 0 end, 2 sleep d, 4 set colour
r g b d, 8 fade to colour r g b d; loops (12 begin n, 13 end) are read too. A programme of nothing is one zero byte.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, ReadOnly, numbers, owned
from minsnap.errors import FileError, InputError

TICK = 0.02
"""Unit of time [s]."""

END, SLEEP, SET, FADE, LOOP, LOOP_END = 0, 2, 4, 8, 12, 13
MOST_COMMANDS = 100_000
"""Commands that a programme runs at most, loops included."""


@dataclass(frozen=True, eq=False)
class Lights(ReadOnly):
    """Colours of one lamp.

    Parameters
    ----------
    instants : array_like, shape (n,)
        When each colour is reached, not descending [s].
    colours : array_like, shape (n, 3)
        Red, green, blue, from 0 to 255.
    fades : array_like of bool, shape (n,)
        Whether the lamp changes to the colour from the instant before; else it does at its instant.

    Raises
    ------
    InputError
        If they do not fit together.
    """

    instants: FloatArray
    colours: FloatArray
    fades: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        instants, colours = numbers(self.instants), numbers(self.colours)
        fades = np.asarray(self.fades, dtype=bool)
        if instants is None or instants.ndim != 1 or not (np.diff(instants, prepend=0.0) >= 0.0).all():
            raise InputError("the instants of lights must be numbers from 0 on that do not descend [s]")
        if colours is None or colours.shape != (len(instants), 3) or not ((colours >= 0) & (colours <= 255)).all():
            raise InputError("the colours of lights must be three numbers from 0 to 255 for each instant")
        if fades.shape != instants.shape:
            raise InputError(f"there are {fades.size} fades for {len(instants)} colours: give one for each")
        for name, value in (("instants", instants), ("colours", colours)):
            object.__setattr__(self, name, owned(value))
        object.__setattr__(self, "fades", fades.copy())

    def __call__(self, t: npt.ArrayLike) -> FloatArray:
        """Return the colour at instants of any shape, black before the first: ``t.shape + (3,)``."""
        t = np.asarray(t, dtype=np.float64)
        after = np.searchsorted(self.instants, t, side="right")
        padded = np.vstack([np.zeros(3), self.colours])
        if not len(self.instants):
            return np.zeros((*t.shape, 3))
        start = np.concatenate([[0.0], self.instants])[after]
        following = np.minimum(after, len(self.instants) - 1)
        fading = (after < len(self.instants)) & self.fades[following]
        width = np.maximum(self.instants[following] - start, 1e-12)
        share = np.where(fading, (t - start) / width, 0.0)[..., None]
        return np.asarray(padded[after] * (1.0 - share) + self.colours[following] * share)


def light_bytes(lights: Lights | None) -> bytes:
    """Return the programme of lights; instants are rounded to 20 ms, and the roundings do not add up."""
    if lights is None or not len(lights.instants):
        return bytes([END])
    ticks = np.diff(np.round(lights.instants / TICK).astype(int), prepend=0).tolist()
    colours = [bytes(row) for row in np.round(lights.colours).astype(np.uint8).tolist()]
    programme, now = b"", bytes(3)
    for wait, colour, fades in zip(ticks, colours, lights.fades.tolist(), strict=True):
        if fades:
            programme += bytes([FADE]) + colour + _varint(wait)
        else:
            programme += (bytes([SET]) + now + _varint(wait) if wait else b"") + bytes([SET]) + colour + _varint(0)
        now = colour
    return programme + bytes([END])


def lights_of(programme: bytes) -> Lights | None:
    """Return the lights of a programme; None if it sets no colour.

    Raises
    ------
    FileError
        If it is cut off, or has a command other than those of this module.
    """
    clock, keys, commands = 0, [], list(_commands(programme))
    for command, colour, ticks in commands:
        if command == FADE or (command == SET and ticks == 0):
            keys.append((clock + ticks, colour, command == FADE))
        elif command == SET:
            keys.append((clock, colour, False))
        clock += ticks
    if not keys:
        return None
    instants, colours, fades = zip(*keys, strict=True)
    return Lights(np.array(instants) * TICK, np.array(colours, dtype=np.float64), np.array(fades))


def _commands(programme: bytes) -> list[tuple[int, tuple[int, ...], int]]:
    """Return commands with their colours and ticks, loops written out."""
    commands: list[tuple[int, tuple[int, ...], int]] = []
    offset, steps = 0, 0
    loops: list[list[int]] = []
    while offset < len(programme) and programme[offset] != END:
        command = programme[offset]
        offset, steps = offset + 1, steps + 1
        if command in (SET, FADE, SLEEP):
            count = 0 if command == SLEEP else 3
            colour = tuple(programme[offset : offset + count])
            ticks, offset = _read_varint(programme, offset + count)
            commands.append((command, colour, ticks))
        elif command == LOOP and offset < len(programme):
            loops.append([offset + 1, programme[offset] - 1])
            offset += 1
        elif command == LOOP_END and loops:
            if loops[-1][1] > 0:
                loops[-1][1] -= 1
                offset = loops[-1][0]
            else:
                loops.pop()
        else:
            raise FileError(
                f"a programme of lights has command {command}, which is not read: 0, 2, 4, 8, 12 and 13 are"
            )
        if steps > MOST_COMMANDS:  # loops in loops that do nothing count too
            raise FileError(f"a programme of lights runs more than {MOST_COMMANDS} commands")
    return commands


def _varint(value: int) -> bytes:
    """Return seven bits a byte, lowest first, the highest bit set on all but the last."""
    encoded = b""
    while value > 127:
        encoded += bytes([value & 127 | 128])
        value >>= 7
    return encoded + bytes([value])


def _read_varint(content: bytes, offset: int) -> tuple[int, int]:
    value, shift = 0, 0
    while True:
        if offset >= len(content) or shift > 28:
            raise FileError("a programme of lights is cut off")
        value |= (content[offset] & 127) << shift
        offset, shift = offset + 1, shift + 7
        if content[offset - 1] < 128:
            return value, offset
