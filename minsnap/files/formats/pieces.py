"""Trajectories as rows of power coefficients in seconds, heading included, the form of other programs' files."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FileError, YawError
from minsnap.polynomials.bernstein import points_to_powers, powers_to_points
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.path import Path
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.polynomial_form import as_polynomials
from minsnap.trajectory.trajectory import Trajectory

YAW_TOLERANCE = 1e-3
"""Greatest difference of a heading from its written polynomial [rad]."""

SHAPE_ERRORS = (1e-6, 1e-5, 1e-4, 1e-3)
"""Errors that a shape's polynomials may have: the first for which they fit the format [m]."""

_CHECKS = 33


def polynomials_of(path: Path, most_pieces: int | None = None) -> tuple[Trajectory, str | None]:
    """Return a path as polynomials, and a sentence on their error if it is none already.

    Parameters
    ----------
    path : Path
        A trajectory, or a shape.
    most_pieces : int or None
        What the format holds.

    Raises
    ------
    InputError
        If no polynomials of a proved error are known for such a path.
    """
    if isinstance(path, Trajectory):
        return path, None
    for error in SHAPE_ERRORS:
        curve = as_polynomials(path, error)
        if most_pieces is None or len(curve.durations) <= most_pieces:
            break
    return curve, f"the shape is written as {len(curve.durations)} polynomials, at most {error:g} m from it"


def check_spatial(trajectory: Trajectory, what: str) -> None:
    """Raise FileError where a file of three coordinates cannot hold a trajectory."""
    if trajectory.dim != 3:
        raise FileError(f"{what} holds 3 coordinates, and the trajectory has {trajectory.dim}")


def position_powers(trajectory: Trajectory, degree: int) -> FloatArray:
    """Ascending powers of the seconds since each piece's start.

    Returns
    -------
    ndarray, shape (pieces, degree + 1, dim)

    Raises
    ------
    FileError
        If the trajectory's degree is higher than that.
    """
    if trajectory.degree > degree:
        raise FileError(
            f"the trajectory has degree {trajectory.degree}, and this format holds {degree}: plan with degree={degree}"
        )
    powers = np.einsum("ij,mjd->mid", points_to_powers(trajectory.degree), trajectory.control_points)
    powers /= trajectory.durations[:, None, None] ** np.arange(trajectory.degree + 1)[None, :, None]
    return np.pad(powers, ((0, 0), (0, degree - trajectory.degree), (0, 0)))


def yaw_powers(trajectory: Trajectory, degree: int) -> FloatArray:
    """Heading of each piece as ascending powers, shape (pieces, degree + 1).

    The interpolant at the Chebyshev points of each piece, ends included; exact for headings that are polynomials of
    that degree.

    Raises
    ------
    YawError
        If a heading is no such polynomial to :data:`YAW_TOLERANCE`, as one along the velocity may not be.
    """
    s = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    powers = np.linalg.solve(np.vander(s, increasing=True), _yaw_at(trajectory, s).T).T
    check = np.linspace(0, 1, _CHECKS)
    error = np.abs(powers @ np.vander(check, degree + 1, increasing=True).T - _yaw_at(trajectory, check)).max(axis=1)
    if error.max() > YAW_TOLERANCE:
        raise YawError(
            f"the heading of piece {error.argmax()} is {error.max():.3g} rad from any polynomial of degree {degree}: "
            "use a planned or constant yaw, or shorter legs"
        )
    scaled: FloatArray = powers / trajectory.durations[:, None] ** np.arange(degree + 1)
    return scaled


def _yaw_at(trajectory: Trajectory, s: FloatArray) -> FloatArray:
    """Heading at normalised times s of every piece, shape (pieces, len(s))."""
    t = trajectory.breaks[:-1, None] + trajectory.durations[:, None] * s
    return trajectory.yaw(np.minimum(t, trajectory.breaks[1:, None]))


def from_powers(durations: FloatArray, powers: FloatArray, yaw: FloatArray | None) -> Trajectory:
    """Return the trajectory of power coefficients.

    Parameters
    ----------
    durations : ndarray, shape (pieces,)
        [s].
    powers : ndarray, shape (pieces, degree + 1, dim)
        Ascending powers of seconds.
    yaw : ndarray, shape (pieces, degree + 1), or None
        The same for the heading; zero when None.
    """
    heading: Heading = ConstantHeading()
    if yaw is not None and (yaw[:, 1:].any() or np.ptp(yaw[:, 0])):
        heading = PlannedHeading(Trajectory(_points(durations, yaw[:, :, None]), durations))
    elif yaw is not None:
        heading = ConstantHeading(float(yaw[0, 0]))
    return Trajectory(_points(durations, powers), durations, heading)


def _points(durations: FloatArray, powers: FloatArray) -> FloatArray:
    degree = powers.shape[1] - 1
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = powers * durations[:, None, None] ** np.arange(degree + 1)[None, :, None]
    points: FloatArray = np.einsum("ji,mid->mjd", powers_to_points(degree), scaled)
    return points
