"""Linear equations in exact rational arithmetic, by elimination."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from fractions import Fraction
from typing import Any

Equation = tuple[Mapping[Any, Fraction], Fraction]
"""Coefficients by unknown, and a right-hand side."""


def solution(rows: Sequence[Equation], total: Fraction) -> list[Fraction] | None:
    """Multipliers y of rows (coefficients, side) with sum y coefficients = 0 and sum y side = total.

    Returns
    -------
    list of Fraction
        One for each row; 0 for those that the equations leave open. None where there are none.
    """
    unknowns: set[Hashable] = set().union(*(coefficients.keys() for coefficients, _ in rows))
    zero = Fraction(0)
    equations = [[coefficients.get(name, zero) for coefficients, _ in rows] + [zero] for name in unknowns]
    equations.append([side for _, side in rows] + [total])
    pivots = _eliminated(equations, len(rows))
    if any(row[-1] for row in equations[len(pivots) :]):
        return None
    found = [zero] * len(rows)
    for row, column in zip(equations, pivots, strict=False):
        found[column] = row[-1]
    return found


def _eliminated(equations: list[list[Fraction]], columns: int) -> list[int]:
    """Bring equations to reduced echelon form, in place; return the columns of the pivots, one for each first row."""
    pivots: list[int] = []
    for column in range(columns):
        top = len(pivots)
        place = next((i for i in range(top, len(equations)) if equations[i][column]), None)
        if place is None:
            continue
        equations[top], equations[place] = equations[place], equations[top]
        scale = equations[top][column]
        equations[top] = [value / scale for value in equations[top]]
        for i, row in enumerate(equations):
            if i != top and row[column]:
                factor = row[column]
                equations[i] = [a - factor * b if b else a for a, b in zip(row, equations[top], strict=True)]
        pivots.append(column)
    return pivots
