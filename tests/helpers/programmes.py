"""Quadratic programmes made by hand, and answers of DAQP that are made wrong."""

import daqp
import numpy as np


def change_daqp(monkeypatch, change):
    """Let answers of DAQP be changed before they are looked at; None refuses."""
    solve = daqp.solve

    def changed(*asked, **options):
        x, cost, status, told = solve(*asked, **options)
        other = change(x)
        return (x, cost, -1, told) if other is None else (other, cost, status, told)

    monkeypatch.setattr(daqp, "solve", changed)


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
