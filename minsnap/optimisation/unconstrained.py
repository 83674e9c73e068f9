"""The optimum without inequalities: where the cost has no slope in what is free."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from decimal import Context, Decimal, localcontext

import numpy as np
from scipy.sparse.linalg import splu

from minsnap.basics.arrays import FloatArray
from minsnap.errors import SolverError
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.polynomials.bernstein import exact_ends_gram

DIGITS = 60
"""Decimal digits, for durations that double precision cannot resolve: they differ by r, the Hessian by r^(2k - 1)."""

RESOLVED = {2: np.inf, 3: 1e6, 4: 300.0, 5: 20.0, 6: 4.0}
"""By k: the ratio of durations up to which double precision gives the optimum to about 1e-9."""

Row = defaultdict[int, Decimal]


def unbounded_optimum(problem: ReducedProblem) -> FloatArray:
    """Knot values of least cost that keep every pin, bounded positions held at their nominal values.

    Returns
    -------
    ndarray, shape (knots, slots, dim)

    Raises
    ------
    SolverError
        If even decimals do not resolve the durations.
    """
    free = problem.free.copy()
    free[problem.held, 0] = False
    chain = replace(problem, free=free)
    if not chain.size:
        return chain.values
    extreme = np.ptp(np.log(chain.durations)) > np.log(RESOLVED[chain.half])
    unknowns = None if extreme else _in_doubles(chain)
    return chain.add(chain.values, _in_decimals(chain) if unknowns is None else unknowns)


def _in_doubles(problem: ReducedProblem) -> FloatArray | None:
    """Unknowns (size,); None where the Hessian is not positive definite but for rounding."""
    try:
        factor = splu(problem.hessian, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return None
    slope = problem.slope(problem.values, np.ones(len(problem.held), dtype=bool))
    return np.asarray(factor.solve(-slope)) if factor.U.diagonal().min() > 0.0 else None


def _in_decimals(problem: ReducedProblem) -> FloatArray:
    """Unknowns (size,) by elimination, one after the other along the chain."""
    with localcontext(Context(prec=DIGITS)):
        rows, right = _system(problem)
        sizes = [row[j] for j, row in enumerate(rows)]
        unknowns = [Decimal(0)] * len(rows)
        for j, row in enumerate(rows):
            if row[j] <= Decimal(10) ** (10 - DIGITS) * sizes[j]:
                raise SolverError(
                    "the system without inequalities is singular to working precision: durations or pins are too "
                    "extreme"
                )
            for i in [i for i in row if i > j]:
                share = row[i] / row[j]
                right[i] -= share * right[j]
                for column, value in row.items():
                    if column >= i:
                        rows[i][column] -= share * value
        for j in reversed(range(len(rows))):
            known = sum(value * unknowns[i] for i, value in rows[j].items() if i > j)
            unknowns[j] = (right[j] - known) / rows[j][j]
    return np.array(unknowns, dtype=np.float64)


def _system(problem: ReducedProblem) -> tuple[list[Row], list[Decimal]]:
    """Half the Hessian, its upper half in rows by column, and minus half the gradient at the pinned values."""
    k, size = problem.half, problem.size
    gram = [[Decimal(q.numerator) / q.denominator for q in row] for row in exact_ends_gram(problem.degree)]
    rows, right = [Row(Decimal) for _ in range(size)], [Decimal(0)] * size
    ends = problem.plain_ends(problem.values)
    for duration, piece, known in zip(problem.durations, problem.piece_columns, ends, strict=True):
        powers = [Decimal(float(duration)) ** power for power in range(1 - 2 * k, 0)]
        block = [[powers[a % k + b % k] * q for b, q in enumerate(row)] for a, row in enumerate(gram)]
        for columns, values in zip(piece.tolist(), known.T.tolist(), strict=True):
            for own, factors in zip(columns, block, strict=True):
                if own < 0:
                    continue
                for column, factor, value in zip(columns, factors, values, strict=True):
                    right[own] -= factor * Decimal(value)
                    if column >= own:
                        rows[own][column] += factor
    return rows, right
