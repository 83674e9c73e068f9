"""Letters of single strokes, as a pen or a row of vehicles draws them: one line where a font has two outlines.

They are drawn for this package. A letter is the data of an SVG path, y upwards: capitals are 6 high, small letters 4,
and what hangs below the line goes down to -2. Letters with accents are put together from both.
"""

from __future__ import annotations

import unicodedata

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.shows.svg_lines import path_lines

GAP, SPACE, LINE, CAPITAL, SMALL = 1.6, 3.0, 9.0, 6.0, 4.0
"""Between letters, for a space, from line to line; heights of letters."""

_BOWL = "M3 2A1.5 2 0 0 1 0 2A1.5 2 0 0 1 3 2"
_ROUND = "M2 6A2 3 0 0 1 2 0A2 3 0 0 1 2 6"
_SMALL_ROUND = "M1.5 4A1.5 2 0 0 1 1.5 0A1.5 2 0 0 1 1.5 4"

GLYPHS = {
    "A": "M0 0 2 6 4 0M.7 2H3.3",
    "B": "M0 0V6H2.5A1.5 1.5 0 0 0 2.5 3H0M2.5 3A1.5 1.5 0 0 0 2.5 0H0",
    "C": "M3.73 4.5A2 3 0 1 1 3.73 1.5",
    "D": "M0 0V6H1.5A2.5 3 0 0 0 1.5 0H0",
    "E": "M4 0H0V6H4M0 3H3",
    "F": "M0 0V6H4M0 3H3",
    "G": "M3.73 4.5A2 3 0 1 1 4 3H2.5",
    "H": "M0 0V6M4 0V6M0 3H4",
    "I": "M0 0V6",
    "J": "M3 6V1.5A1.5 1.5 0 0 0 0 1.5",
    "K": "M0 0V6M4 6 0 2.4M1.4 3.7 4 0",
    "L": "M0 6V0H3.6",
    "M": "M0 0V6L2.5 2 5 6V0",
    "N": "M0 0V6L4 0V6",
    "O": _ROUND,
    "P": "M0 0V6H2.5A1.6 1.6 0 0 0 2.5 2.8H0",
    "Q": f"{_ROUND}M2.4 1.6 4 -.3",
    "R": "M0 0V6H2.5A1.6 1.6 0 0 0 2.5 2.8H0M1.8 2.8 4 0",
    "S": "M3.8 4.9C3.4 5.7 2.8 6 2 6C.9 6 .2 5.4 .2 4.5C.2 2.6 3.9 3.4 3.9 1.5C3.9 .6 3.1 0 2 0C1.1 0 .4 .4 0 1.2",
    "T": "M0 6H4M2 6V0",
    "U": "M0 6V2A2 2 0 0 1 4 2V6",
    "V": "M0 6 2 0 4 6",
    "W": "M0 6 1.4 0 2.8 5 4.2 0 5.6 6",
    "X": "M0 0 4 6M0 6 4 0",
    "Y": "M0 6 2 3 4 6M2 3V0",
    "Z": "M0 6H4L0 0H4",
    "a": f"{_BOWL}M3 4V0",
    "b": f"{_BOWL}M0 6V0",
    "c": "M2.6 3.36A1.5 2 0 1 1 2.6 .64",
    "d": f"{_BOWL}M3 6V0",
    "e": "M0 2H3A1.5 2 0 1 1 2.7 .8",
    "f": "M2.2 5.8C1.3 6.2 .8 5.6 .8 4.6V0M0 4H2",
    "g": f"{_BOWL}M3 4V-.5A1.5 1.5 0 0 0 .1 -.8",
    "h": "M0 6V0M0 2.5A1.5 1.5 0 0 0 3 2.5V0",
    "i": "M0 0V4M0 5.2V5.7",
    "ı": "M0 0V4",
    "j": "M1 4V-.7A1 1 0 0 0 0 -1.7M1 5.2V5.7",
    "k": "M0 6V0M2.6 4 0 1.6M.9 2.4 2.8 0",
    "l": "M0 6V0",
    "m": "M0 4V0M0 2.75A1.25 1.25 0 0 0 2.5 2.75V0M2.5 2.75A1.25 1.25 0 0 0 5 2.75V0",
    "n": "M0 4V0M0 2.5A1.5 1.5 0 0 0 3 2.5V0",
    "o": _SMALL_ROUND,
    "p": f"{_BOWL}M0 4V-2",
    "q": f"{_BOWL}M3 4V-2",
    "r": "M0 4V0M0 2.4C.3 3.5 1 4 2 3.9",
    "s": "M2.7 3.3C2.4 3.8 2 4 1.4 4C.6 4 .1 3.6 .1 3C.1 1.7 2.8 2.3 2.8 1C2.8 .4 2.2 0 1.4 0C.7 0 .2 .3 0 .8",
    "t": "M.8 5.4V1.2C.8 .2 1.4 -.1 2.2 .2M0 4H2",
    "u": "M0 4V1.5A1.5 1.5 0 0 1 3 1.5M3 4V0",
    "v": "M0 4 1.5 0 3 4",
    "w": "M0 4 1.1 0 2.2 3.4 3.3 0 4.4 4",
    "x": "M0 0 2.8 4M0 4 2.8 0",
    "y": "M0 4 1.5 0M3 4 .8 -2",
    "z": "M0 4H2.8L0 0H2.8",
    "0": "M1.75 6A1.75 3 0 0 1 1.75 0A1.75 3 0 0 1 1.75 6",
    "1": "M0 4.8 1.4 6V0",
    "2": "M.1 4.4A1.75 1.6 0 0 0 3.5 4.4C3.5 3 0 1.2 0 0H3.6",
    "3": "M.2 5.2C.6 5.8 1.1 6 1.7 6C2.8 6 3.4 5.4 3.4 4.6C3.4 3.7 2.7 3.2 1.5 3.2"
    "C2.8 3.2 3.6 2.6 3.6 1.6C3.6 .6 2.8 0 1.7 0C.9 0 .3 .3 0 1",
    "4": "M2.8 0V6L0 1.8H3.8",
    "5": "M3.3 6H.6L.3 3.2C.7 3.6 1.2 3.8 1.8 3.8C2.9 3.8 3.6 3 3.6 1.9C3.6 .8 2.8 0 1.7 0C.9 0 .3 .3 0 .9",
    "6": "M3.2 5.5C2.8 5.9 2.4 6 2.1 6C.8 6 0 4.4 0 1.9A1.75 1.9 0 0 1 3.5 1.9A1.75 1.9 0 0 1 0 1.9",
    "7": "M0 6H3.6L1.2 0",
    "8": "M1.75 3.1A1.45 1.45 0 0 0 1.75 6A1.45 1.45 0 0 0 1.75 3.1A1.75 1.55 0 0 1 1.75 0A1.75 1.55 0 0 1 1.75 3.1",
    "9": "M.3 .5C.7 .1 1.1 0 1.4 0C2.7 0 3.5 1.6 3.5 4.1A1.75 1.9 0 0 1 0 4.1A1.75 1.9 0 0 1 3.5 4.1",
    ".": "M0 0V.5",
    ",": "M.4 .5 0 -.8",
    ":": "M0 .5V1M0 3V3.5",
    ";": "M.4 .5 0 -.8M.4 3V3.5",
    "!": "M0 6V1.8M0 0V.5",
    "?": "M0 4.8C.3 5.6 .9 6 1.6 6C2.6 6 3.2 5.4 3.2 4.5C3.2 3 1.5 3.2 1.5 1.8M1.5 0V.5",
    "-": "M0 3H2",
    "–": "M0 3H3",
    "+": "M0 3H3M1.5 1.5V4.5",
    "=": "M0 2.2H3M0 3.8H3",
    "/": "M0 -.5 2.5 6.5",
    "\\": "M0 6.5 2.5 -.5",
    "(": "M1.2 6.8Q-.6 3 1.2 -.8",
    ")": "M0 6.8Q1.8 3 0 -.8",
    "<": "M3 5 0 3 3 1",
    ">": "M0 5 3 3 0 1",
    "_": "M0 -.6H4",
    "'": "M0 6V4.8",
    "’": "M0 6V4.8",
    '"': "M0 6V4.8M1 6V4.8",
    "*": "M1.5 3V6M.2 3.8 2.8 5.2M.2 5.2 2.8 3.8",
    "#": "M.8 0 1.6 6M2.4 0 3.2 6M0 2H3.6M.4 4H4",
    "%": "M.8 6A.8 1.1 0 0 1 .8 3.8A.8 1.1 0 0 1 .8 6M3.4 2.2A.8 1.1 0 0 1 3.4 0A.8 1.1 0 0 1 3.4 2.2M.5 0 3.7 6",
    "&": "M4 0 .8 4.4C.2 5.2 .8 6 1.6 6C2.4 6 2.9 5.2 2.4 4.4C1.9 3.6 0 3 0 1.4C0 .5 .8 0 1.6 0C2.7 0 3.6 1.2 3.8 2.6",
    "@": "M4 .6A2.5 3 0 1 0 5 3C5 1.6 3.6 1.6 3.6 2.6V4.2M3.6 3A1 1.2 0 0 1 1.6 3A1 1.2 0 0 1 3.6 3",
    "€": "M3.9 5.2A2.2 3 0 1 1 3.9 .8M-.2 3.5H2.8M-.2 2.5H2.6",
    "°": "M.7 6A.7 .7 0 0 1 .7 4.6A.7 .7 0 0 1 .7 6",
    "♥": "M2.5 0C.5 2 -.5 3.4 0 4.6C.5 5.8 2 5.8 2.5 4.5C3 5.8 4.5 5.8 5 4.6C5.5 3.4 4.5 2 2.5 0",
    "ß": "M0 0V4.6A1.4 1.4 0 0 0 2.8 4.6C2.8 3.7 1.8 3.5 1.8 3.2C3.4 2.8 3.4 .2 1.3 .1",
    "Ø": f"{_ROUND}M.2 -.4 3.8 6.4",
    "ø": f"{_SMALL_ROUND}M0 -.4 3 4.4",
    "Æ": "M0 0 2.4 6H6M3.2 6V0H6M3.2 3H5.4M.8 2H3.2",
    "æ": "M2.5 2A1.25 2 0 0 1 0 2A1.25 2 0 0 1 2.5 2H5A1.25 2 0 0 1 2.5 2A1.25 2 0 0 1 4.75 .8",
    "Œ": "M2 6A2 3 0 0 1 2 0M2 6H5.5M2 0H5.5M2.6 0V6M2.6 3H5",
    "œ": "M2.5 2A1.25 2 0 0 1 0 2A1.25 2 0 0 1 2.5 2H5A1.25 2 0 0 1 2.5 2A1.25 2 0 0 1 4.75 .8",
    "ł": "M1 6V0M0 2.3 2 3.7",
    "Ł": "M.8 6V0H4.2M0 2.3 2.4 3.9",
}
"""Path data of each letter."""

MARKS = {
    "\u0300": "M-.6 1.5 .2 .7",
    "\u0301": "M-.2 .7 .6 1.5",
    "\u0302": "M-.8 .7 0 1.5 .8 .7",
    "\u0303": "M-.9 .8C-.3 1.6 .3 .4 .9 1.2",
    "\u0304": "M-.8 1H.8",
    "\u0306": "M-.8 1.4C-.5 .5 .5 .5 .8 1.4",
    "\u0307": "M0 .7V1.2",
    "\u0308": "M-.7 .7V1.2M.7 .7V1.2",
    "\u030a": "M0 .5A.5 .5 0 0 0 0 1.5A.5 .5 0 0 0 0 .5",
    "\u030b": "M-.5 .7 0 1.5M.3 .7 .8 1.5",
    "\u030c": "M-.8 1.5 0 .7 .8 1.5",
    "\u0327": "M0 0C.6 -.6 .4 -1.3 -.3 -1.1",
    "\u0328": "M.3 0C-.4 -.5 -.2 -1.3 .5 -1.1",
}
"""Accents, around the middle of the letter: above its top, or those that hang below the line."""

BELOW = ("\u0327", "\u0328")


def stroke_lines(words: str) -> list[FloatArray]:
    """Return the strokes of words, each line of them in the middle, polylines of shape (n, 2), y up.

    Their unit is a sixth of the height of a capital. What has no strokes (``missing_strokes``) is left out.
    """
    lines = []
    for row, text in enumerate(words.splitlines()):
        strokes, x = [], 0.0
        for letter in text:
            glyph = _glyph(letter)
            if not glyph:
                x += SPACE
                continue
            across = np.concatenate(glyph)[:, 0]
            strokes += [line + (x - across.min(), -LINE * row) for line in glyph]
            x += float(np.ptp(across)) + GAP
        lines += [line - (0.5 * (x - GAP), 0.0) for line in strokes]
    return lines


def missing_strokes(words: str) -> list[str]:
    """Return the letters that have no strokes, each once."""
    return [letter for letter in dict.fromkeys(words) if not letter.isspace() and not _glyph(letter)]


def _glyph(letter: str) -> list[FloatArray]:
    """Return the lines of a letter, and none where it has no strokes."""
    if letter in GLYPHS:
        return path_lines(GLYPHS[letter])
    base, *marks = list(unicodedata.normalize("NFD", letter))
    if not marks or base not in GLYPHS or any(mark not in MARKS for mark in marks):
        return []
    lines = path_lines(GLYPHS["ı" if base == "i" else base])
    points = np.concatenate(lines)
    middle, top = (points[:, 0].min() + points[:, 0].max()) / 2.0, SMALL if points[:, 1].max() < 4.5 else CAPITAL
    for mark in marks:
        lines += [line + (middle, 0.0 if mark in BELOW else top) for line in path_lines(MARKS[mark])]
    return lines
