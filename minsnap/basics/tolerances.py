"""The tolerances that rooms share."""

from __future__ import annotations

EXACT = 1e-9
"""Share of a length, an angle or a limit below which two values count as equal."""

ROUNDING = 1e-12
"""Share of the largest entry of a vector or a matrix below which an entry counts as the rounding of zero."""

GAP = 9e-7
"""Share of a plan's cost that a proof may cost: both cores move walls inwards by at most that."""
