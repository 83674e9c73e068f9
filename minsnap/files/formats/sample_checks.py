"""Checks of samples from a file: consistent shapes, finite numbers, increasing times."""

from __future__ import annotations

import numpy as np

from minsnap.errors import FileError
from minsnap.trajectory.samples import ARRAYS, VECTORS, Samples


def checked_samples(samples: Samples) -> Samples:
    """Return samples unchanged.

    Raises
    ------
    FileError
        If an array has another shape than the instants and the position ask for, a number is not finite, or the
        instants do not increase.
    """
    count, dim = np.shape(samples.t), np.shape(samples.position)[1:]
    if len(count) != 1 or not count[0] or len(dim) != 1 or not dim[0]:
        raise FileError(f"samples have instants (m,) and positions (m, dim), not {count} and {samples.position.shape}")
    if not (np.isfinite(samples.lead) and samples.lead >= 0.0):
        raise FileError(f"the lead is {samples.lead} s: it must be 0 or more")
    for name in ARRAYS:
        values = getattr(samples, name)
        if values is None:
            continue
        wanted = (*count, *dim) if name in VECTORS else count
        if values.shape != wanted:
            raise FileError(f"{name} has the shape {values.shape}, and the instants ask for {wanted}")
        if not np.isfinite(values).all():
            raise FileError(f"{name} holds a number that is not finite")
    late = np.flatnonzero(np.diff(samples.t) <= 0.0)
    if late.size:
        raise FileError(f"instant {late[0] + 1} is not after the one before: instants must increase")
    return samples
