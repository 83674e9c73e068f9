"""Polynomials as other programs' files hold them: powers in seconds, headings with their rules, fits to samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, NDArray
from minsnap.errors import FileError, YawError
from minsnap.polynomials.bernstein import ends_to_points, mapped, points_to_powers, powers_to_points
from minsnap.trajectory.heading import ConstantHeading, Heading, nearest_turn
from minsnap.trajectory.look_at import LookAt
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.path import Path
from minsnap.trajectory.phase import as_polynomials
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.velocity_heading import VelocityHeading

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
    return np.asarray(powers / trajectory.durations[:, None] ** np.arange(degree + 1))


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
    return np.asarray(np.einsum("ji,mid->mjd", powers_to_points(degree), scaled))


def yaw_description(trajectory: Trajectory) -> dict[str, Any]:
    """Return the heading of a trajectory as plain numbers, text and lists.

    Raises
    ------
    YawError
        If it is no constant, follows from the curve by no rule, and is no polynomial to a milliradian.
    """
    heading = trajectory.yaw
    if heading.constant is not None:
        return {"angle": heading.constant}
    rule = heading.rule(trajectory)
    if rule is not None:
        return rule
    planned = heading.polynomial
    if planned is None:
        powers = yaw_powers(trajectory, max(trajectory.degree, 7))
        planned = from_powers(trajectory.durations, powers[:, :, None], None)
    return {"durations": planned.durations.tolist(), "control_points": planned.control_points.tolist()}


def headed(curve: Trajectory, content: Mapping[str, Any]) -> Trajectory:
    """Give a curve the heading that a file describes."""
    if "rule" not in content:
        return curve.with_yaw(_heading(content))
    if content["rule"] == "velocity":
        rule = content["yaw_rate"], content["hold_below"], content.get("yaw_at_start")
        return curve.with_yaw(VelocityHeading(curve, *rule))
    if content["rule"] == "tilt":
        linear, quadratic = content.get("drag", (0.0, 0.0))
        medium = Medium(float(content["gravity"]), float(linear), float(quadratic))
        return curve.with_yaw(TiltHeading(curve, float(content["angle_at_start"]), medium))
    if content["rule"] == "look at":
        return curve.with_yaw(LookAt(content["point"]).heading(curve))
    raise FileError(f"no heading is called {str(content['rule'])[:40]!r}: there are velocity, tilt and look at")


def _heading(content: Mapping[str, Any]) -> Heading:
    if "control_points" not in content:
        angle = float(content["angle"])
        if not np.isfinite(angle):
            raise FileError(f"the yaw is {angle}: it must be finite")
        return ConstantHeading(angle)
    points, durations = (np.array(content[name], dtype=np.float64) for name in ("control_points", "durations"))
    return PlannedHeading(Trajectory(points, durations))


TOLERANCE = 1e-3
"""Greatest distance of the curve from a sample [m], and of its heading [rad]."""


def refit(samples: Samples, max_pieces: int | None = None) -> Trajectory:
    """Return quintics through some of the samples that pass within a millimetre and a milliradian of all of them.

    Each piece meets position, velocity and acceleration of the samples at its ends (Hermite), so the curve is twice
    continuously differentiable; the number of pieces is the smallest that suffices, and they are of nearly equal
    length. Where the headings of the samples jump by whole turns, the fitted one goes on.

    Parameters
    ----------
    samples : Samples
        With velocities and accelerations.
    max_pieces : int or None
        No more than this.

    Raises
    ------
    FileError
        If there are no accelerations, or too few pieces are allowed; says what they would reach.
    """
    if samples.velocity is None or samples.acceleration is None:
        raise FileError(
            "polynomials need samples with velocities and accelerations: for positions alone give the distance that is "
            "allowed, tolerance=0.005 (--tolerance 5mm)"
        )
    samples = replace(samples, yaw=_continuous(samples))
    most = min(len(samples) - 1, max_pieces or len(samples) - 1)
    for pieces in _growing(most):
        knots = np.unique(np.round(np.linspace(0, len(samples) - 1, pieces + 1)).astype(int))
        trajectory = through(samples, knots)
        error, unit = _deviation(trajectory, samples)
        if error <= TOLERANCE:
            return trajectory
    raise FileError(f"{most} pieces are {error:.3g} {unit} from the samples, more than {TOLERANCE:g}: fly it in parts")


def _continuous(samples: Samples) -> FloatArray | None:
    """Return the headings without jumps of whole turns: each step as near as can be to what the yaw rates say, or 0."""
    if samples.yaw is None:
        return None
    rate = np.zeros(len(samples)) if samples.yaw_rate is None else samples.yaw_rate
    steps = np.diff(samples.yaw)
    known = nearest_turn(steps, 0.5 * (rate[1:] + rate[:-1]) * np.diff(samples.t))
    return np.asarray(samples.yaw + np.concatenate([[0.0], np.cumsum(known - steps)]))


def _growing(most: int) -> list[int]:
    """Numbers of pieces to try: 1, 2, 3, … while this is fast, then by factors of 1.2, up to the maximum."""
    counts = [1]
    while counts[-1] < most:
        counts.append(min(most, max(counts[-1] + 1, counts[-1] * 6 // 5)))
    return counts


def through(samples: Samples, knots: NDArray[np.intp] | None = None) -> Trajectory:
    """Return the curve through some samples, by default all: each piece meets what both ends have (Hermite).

    Lines through positions alone, cubics with velocities, quintics with accelerations too; headings alike.

    Parameters
    ----------
    samples : Samples
        Whose instants increase; the curve begins at 0, where the first one is.
    knots : ndarray of int, optional
        Which samples.
    """
    at = np.arange(len(samples)) if knots is None else knots
    durations = np.diff(samples.t[at])
    orders = (samples.position, samples.velocity, samples.acceleration)
    points = _hermite([values[at] for values in orders if values is not None], durations)
    return Trajectory(points, durations, _fitted_heading(samples, at, durations))


def _hermite(orders: list[FloatArray], durations: FloatArray) -> FloatArray:
    """Return control points (pieces, 2 k, dim) that meet k derivatives (m, dim) at both ends of each piece."""
    sides = (slice(None, -1), slice(1, None))
    scaled = [values[side] * durations[:, None] ** order for side in sides for order, values in enumerate(orders)]
    return mapped(ends_to_points(2 * len(orders) - 1), np.stack(scaled, axis=1))


def _fitted_heading(samples: Samples, knots: NDArray[np.intp], durations: FloatArray) -> Heading:
    if samples.yaw is None or np.ptp(samples.yaw) == 0.0:
        return ConstantHeading(0.0 if samples.yaw is None else float(samples.yaw[0]))
    known = [samples.yaw] if samples.yaw_rate is None else [samples.yaw, samples.yaw_rate]
    return PlannedHeading(Trajectory(_hermite([values[knots, None] for values in known], durations), durations))


def _deviation(trajectory: Trajectory, samples: Samples) -> tuple[float, str]:
    """Return the greatest deviation of the curve from a sample, in position or heading, and its unit."""
    t = np.minimum(samples.t - samples.t[0], trajectory.duration)
    apart = float(np.linalg.norm(trajectory(t) - samples.position, axis=1).max())
    turned = 0.0 if samples.yaw is None else float(np.abs(trajectory.yaw(t) - samples.yaw).max())
    return max((apart, "m"), (turned, "rad of heading"))
