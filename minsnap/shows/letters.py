"""Lines of letters: single strokes, or the outlines of a font."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName
from minsnap.errors import FleetError
from minsnap.shows.strokes import missing_strokes, stroke_lines

FONT_FILES = (".ttf", ".otf", ".ttc")


def letter_lines(words: str, outlines: bool = False, font: FileName | None = None) -> list[FloatArray]:
    """Return the lines of words, polylines of shape (n, 2), y up, in a unit of their own.

    Parameters
    ----------
    words : str
    outlines : bool
        Of matplotlib's own font in place of single strokes.
    font : str or path, optional
        Name or file of another font: its outlines.

    Raises
    ------
    FleetError
        If there are no letters, one is missing, or the font is; says which.
    """
    if not words.strip():
        raise FleetError(f"the text {shown(words)} has no letters: give some")
    outlined = outlines or font is not None
    properties = _properties(font) if outlined else None
    missing = _missing_outlines(words, properties) if outlined else missing_strokes(words)
    if missing:
        give = "give another font" if outlined else "give outlines: true, or leave them out"
        where = "the font has" if outlined else "single strokes have"
        raise FleetError(f"{where} no {', '.join(map(repr, missing))} of the text {shown(words)}: {give}")
    return _outlines(words, properties) if outlined else stroke_lines(words)


def _properties(font: FileName | None) -> Any:
    """Return what matplotlib calls a font: by its file, its name, or its own."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    if font is None:
        return FontProperties()
    is_file = Path(font).suffix.lower() in FONT_FILES
    properties = FontProperties(fname=str(font)) if is_file else FontProperties(family=str(font))
    logger = logging.getLogger("matplotlib.font_manager")
    logged, logger.disabled = logger.disabled, True  # it says itself what is said below
    try:
        get_font(findfont(properties, fallback_to_default=False))
    except (ValueError, OSError, RuntimeError):
        give = "give its file" if not is_file else "give a font in TrueType or OpenType"
        raise FleetError(f"the font {shown(str(font))} is not found, or is none: {give}, or leave it out") from None
    finally:
        logger.disabled = logged
    return properties


def _missing_outlines(words: str, properties: Any) -> list[str]:
    from matplotlib.font_manager import findfont, get_font

    font = get_font(findfont(properties))
    return [each for each in dict.fromkeys(words) if not each.isspace() and not font.get_char_index(ord(each))]


def _outlines(words: str, properties: Any) -> list[FloatArray]:
    from matplotlib.textpath import TextPath

    lines: list[FloatArray] = []
    for row, text in enumerate(words.splitlines()):
        polygons = TextPath((0.0, 0.0), text.replace("$", "\\$"), 10.0, prop=properties).to_polygons()
        row_lines = [line for line in map(np.asarray, polygons) if len(line) > 1]
        across = np.concatenate(row_lines)[:, 0] if row_lines else np.zeros(1)
        lines += [line - ((across.min() + across.max()) / 2.0, 12.0 * row) for line in row_lines]
    return lines
