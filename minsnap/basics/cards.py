"""Cards: a small drawing and a table of facts in HTML, which notebooks show for a value; nothing is imported for it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from minsnap.basics.arrays import FloatArray


@dataclass(frozen=True)
class CardSize:
    """Sizes of the drawings of a card [px].

    Parameters
    ----------
    width : float
        Of each drawing.
    height : float
        Of a curve at most.
    strip : float
        Height of a strip.
    margin : float
        Around each drawing.
    dots : int
        Waypoints that are marked at most.
    """

    width: float = 300.0
    height: float = 200.0
    strip: float = 56.0
    margin: float = 10.0
    dots: int = 200


CARD = CardSize()


INK = "#d55e00"
"""Colour of curves, on a white page and on a black one."""

GOOD, BAD = "#009e73", "#cc3311"

Facts = Iterable[tuple[str, str | None]]
"""Names and values, as plain text; a value of None leaves its line out."""


def card(title: str, facts: Facts, drawings: Sequence[str] = (), good: bool | None = None) -> str:
    """Return a card in HTML: title, drawings and a table of facts.

    Parameters
    ----------
    title : str
        Plain text.
    facts : iterable of (str, str or None)
        Plain text, escaped here.
    drawings : sequence of str
        SVG, as the functions of this module return it.
    good : bool, optional
        The title is green for True and red for False.
    """
    colour = "" if good is None else f";color:{GOOD if good else BAD}"
    table = f'<table style="margin:0;border-collapse:collapse">{"".join(_rows(facts))}</table>'
    pictures = f"<div>{''.join(drawings)}</div>" if drawings else ""
    heading = f'<div style="font-weight:600{colour}">{escape(title)}</div>'
    return (
        '<div style="display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start;font-size:90%">'
        f"{pictures}<div>{heading}{table}</div></div>"
    )


def _rows(facts: Facts) -> Iterable[str]:
    cell = 'style="text-align:left;padding:1px 8px 1px 0;vertical-align:top'
    for name, value in facts:
        if value is not None:
            yield f'<tr><td {cell};opacity:0.75">{escape(name)}</td><td {cell}">{escape(value)}</td></tr>'


def curve_svg(points: FloatArray, dots: FloatArray | None = None, caption: str = "") -> str:
    """Draw a curve in the plane with equal scales, its start as a disc, its end as a square, and a bar as scale.

    Parameters
    ----------
    points : ndarray, shape (m, 2)
        Any finite numbers [m].
    dots : ndarray, shape (n, 2), optional
        Marked, if there are not too many.
    caption : str
        Plain text.
    """
    low, span = points.min(axis=0), np.ptp(points / 2.0, axis=0) * 2.0
    room = np.array([CARD.width, CARD.height]) - 2.0 * CARD.margin
    with np.errstate(all="ignore"):
        scale = float(np.nanmin(np.where(span > 0.0, room / span, np.inf)))
    scale = scale if np.isfinite(scale) and scale > 0.0 else 1.0
    height = span[1] * scale + 2.0 * CARD.margin + 14.0
    placed = _placed(points, low, span, scale)
    marks = "" if dots is None or len(dots) > CARD.dots else _dots(_placed(dots, low, span, scale))
    bar = _scale_bar(span.max(), scale, height)
    return _svg(height, f"{_line(placed)}{marks}{_ends(placed)}{bar}", caption)


def strip_svg(t: FloatArray, values: FloatArray, label: str) -> str:
    """Draw a quantity against time in a strip, with its least and greatest value.

    Parameters
    ----------
    t, values : ndarray, shape (m,)
        Instants, ascending, and finite values.
    label : str
        Plain text.
    """
    least, most = float(values.min()), float(values.max())
    room = np.array([CARD.width - 2.0 * CARD.margin, CARD.strip - 24.0])
    shares = np.stack([_share(t), 1.0 - _share(values)], axis=1)
    text = f"{label}: {least:.4g} to {most:.4g}" if most > least else f"{label}: {least:.4g}"
    return _svg(CARD.strip, _line(shares * room + [CARD.margin, 18.0]) + _text(CARD.margin, 11.0, text), label)


def _placed(points: FloatArray, low: FloatArray, span: FloatArray, scale: float) -> FloatArray:
    """Return pixels (m, 2): the second coordinate upwards, both in the middle of the width."""
    with np.errstate(all="ignore"):
        across = np.nan_to_num((points - low) * scale, posinf=0.0, neginf=0.0)
    left = (CARD.width - span[0] * scale) / 2.0
    return np.asarray(np.stack([left + across[:, 0], CARD.margin + span[1] * scale - across[:, 1]], axis=1))


def _share(values: FloatArray) -> FloatArray:
    least, most = values.min() / 2.0, values.max() / 2.0
    return (values / 2.0 - least) / (most - least) if most > least else np.full(len(values), 0.5)


def _line(pixels: FloatArray) -> str:
    places = " ".join(f"{x:.1f},{y:.1f}" for x, y in pixels)
    return f'<polyline points="{places}" fill="none" stroke="{INK}" stroke-width="1.8" stroke-linejoin="round"/>'


def _dots(pixels: FloatArray) -> str:
    circles = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.2"/>' for x, y in pixels)
    return f'<g fill="currentColor">{circles}</g>'


def _ends(pixels: FloatArray) -> str:
    (x, y), (u, v) = pixels[0], pixels[-1] - 4.5
    square = f'<rect x="{u:.1f}" y="{v:.1f}" width="9" height="9" fill="none" stroke="{INK}" stroke-width="1.5"/>'
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{INK}"/>{square}'


def _scale_bar(span: float, scale: float, height: float) -> str:
    """Return a bar of 1, 2 or 5 times a power of ten metres, near a fifth of the extent; nothing for a point."""
    if not 1e-300 < span < 1e300:
        return ""
    size = 10.0 ** np.floor(np.log10(span / 4.0))
    length = max(size * factor for factor in (1.0, 2.0, 5.0) if size * factor <= span / 4.0)
    y, end = height - 6.0, CARD.margin + length * scale
    bar = f'<path d="M{CARD.margin:.1f} {y:.1f}H{end:.1f}" stroke="currentColor" stroke-width="1.5"/>'
    return bar + _text(end + 5.0, y + 4.0, f"{length:g} m")


def _text(x: float, y: float, text: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="11" fill="currentColor">{escape(text)}</text>'


def _svg(height: float, inner: str, caption: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{CARD.width:g}" height="{height:.0f}" role="img" '
        f'style="display:block;max-width:100%" viewBox="0 0 {CARD.width:g} {height:.0f}">'
        f"<title>{escape(caption)}</title>{inner}</svg>"
    )
