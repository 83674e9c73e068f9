"""Quadratic programmes made by hand, and answers of DAQP that are made wrong."""

import numpy as np
import qpsolvers


def change_daqp(monkeypatch, change):
    """Let answers of DAQP be changed before they are looked at; None refuses."""
    original = qpsolvers.solve_problem

    def changed(problem, solver, **options):
        solution = original(problem, solver, **options)
        if solver == "daqp" and solution.x is not None:
            solution.x = change(solution.x)
        return solution

    monkeypatch.setattr(qpsolvers, "solve_problem", changed)


def least_distance(seed, size=8, rows=14):
    """A programme of the kind that the exchange makes: unit diagonal, unit rows, a feasible set that excludes zero."""
    random = np.random.default_rng(seed)
    L = np.eye(size) + 0.3 * np.tril(random.normal(size=(size, size)), -1)
    P = L @ L.T
    scale = 1.0 / np.sqrt(np.diag(P))
    P = P * scale[:, None] * scale
    G = random.normal(size=(rows, size))
    G /= np.linalg.norm(G, axis=1)[:, None]
    inside = random.normal(size=size)
    return P, np.zeros(size), G, G @ inside + random.uniform(0.0, 0.2, rows)
