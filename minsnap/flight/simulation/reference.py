"""The reference of a simulation: setpoints, each held until the next, and the feed-forward that offsets drag."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, interpolated
from minsnap.basics.checks import check_able, check_kind
from minsnap.errors import InputError, TimingError
from minsnap.flight.simulation.controllers import Reference
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples
from minsnap.vehicle.drag import BodyDrag, Drag
from minsnap.vehicle.flatness import spatial
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.states import FlatStates, flat_states


def reference_states(vehicle: Quadrotor, reference: Samples, drag: Drag | None) -> FlatStates:
    """Return attitude and rates of a reference, with the drag if the motion is flat with it, else without drag.

    Parameters
    ----------
    vehicle : Quadrotor
    reference : Samples
        What it lacks (a derivative, yaw) is taken as zero.
    drag : Drag or None
        The model that is offset.

    Returns
    -------
    FlatStates
    """
    motion = _motion(reference, "velocity", "acceleration", "jerk", "snap", "yaw", "yaw_rate")
    return flat_states(vehicle, *motion, drag=drag if isinstance(drag, BodyDrag) else BodyDrag())


def _motion(samples: Samples, *names: str) -> list[FloatArray]:
    """Return quantities of samples in three coordinates; zero where there is none."""
    zero = {True: np.zeros(len(samples)), False: np.zeros((len(samples), 3))}
    known = [(name.startswith("yaw"), getattr(samples, name)) for name in names]
    return [zero[angle] if values is None else values if angle else spatial(values) for angle, values in known]


def drag_feed_forward(vehicle: Quadrotor, reference: Samples, drag: Drag | None = None) -> FloatArray:
    """Return the acceleration that compensates drag along a reference, in still air.

    The reference velocity is rotated into the body frame with the reference attitude from flatness. The drag force is
    rotated back to the world frame; the result is its negative divided by the mass.

    Parameters
    ----------
    vehicle : Quadrotor
    reference : Samples
        With velocity; without, nothing can be offset and the answer is zero.
    drag : Drag or None
        The model to offset; by default the vehicle's own.

    Returns
    -------
    ndarray, shape (m, 3)
        In the world frame [m/s^2].
    """
    check_kind("the vehicle", vehicle, Quadrotor, "a Quadrotor")
    check_kind("the reference", reference, Samples, "samples")
    drag = vehicle.drag if drag is None else drag
    check_able("the drag", drag, "force", "a model of drag")
    if reference.velocity is None:
        return np.zeros((len(reference), 3))
    states = reference_states(vehicle, reference, drag)
    force = drag_in_body(drag, states.rotation, spatial(reference.velocity), states.rotor_speed)
    return np.asarray(-np.einsum("mij,mj->mi", states.rotation, force) / vehicle.mass)


def drag_in_body(drag: Drag, rotation: FloatArray, air: FloatArray, rotor_speed: FloatArray) -> FloatArray:
    """Return the force of drag in the body, shape (m, 3) [N]; ``air`` are velocities through the air in the world."""
    pitch = -np.arcsin(np.clip(rotation[:, 2, 0], -1.0, 1.0))
    return drag.force(np.einsum("mji,mj->mi", rotation, air), pitch=pitch, rotor_speed=rotor_speed)


MOST_STEPS = 2_000_000
"""Steps of the longest flight that is simulated."""


class ReferenceTable:
    """A table of setpoints, and the index of the setpoint valid at an instant.

    Parameters
    ----------
    samples : Samples
        Setpoints; between two of them the earlier one holds.
    vehicle : Quadrotor
        For attitude and rates of the reference.
    compensation : Drag or None
        Model of drag to offset by feed-forward; without one, that which the samples state is followed.
    """

    def __init__(self, samples: Samples, vehicle: Quadrotor, compensation: Drag | None) -> None:
        self.samples = _spatial(samples)
        self.states: FlatStates = reference_states(vehicle, self.samples, compensation)
        self.feed_forward: FloatArray = _added(vehicle, self.samples, compensation)
        self.rows = self._rows()

    def _rows(self) -> list[Reference]:
        moved, turned = ("position", "velocity", "acceleration"), ("yaw", "yaw_rate")
        turning = self.states.body_rates, self.states.angular_acceleration
        columns = (*_motion(self.samples, *moved), self.feed_forward, *_motion(self.samples, *turned), *turning)
        return [Reference(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]

    def index(self, t: FloatArray, delay: float = 0.0) -> npt.NDArray[np.intp]:
        """Return the index of the setpoint valid at each instant, shape (m,), with a delay of the setpoints [s]."""
        start = self.samples.t[0]
        rows = np.searchsorted(self.samples.t - start, t - delay + 1e-9, side="right") - 1
        return np.asarray(np.clip(rows, 0, len(self.samples) - 1))

    def at(self, t: FloatArray, path: Path | Samples) -> Samples:
        """Return the plan at instants, shape (m,): exact for a path, interpolated between samples."""
        if isinstance(path, Path):
            inside = np.minimum(t, path.duration)
            velocity, acceleration = (spatial(path(inside, order)) for order in (1, 2))
            return Samples(t, spatial(path(inside)), velocity, acceleration, yaw=path.yaw(inside))
        own = self.samples.t - self.samples.t[0] + self.samples.lead
        known = self.samples.velocity
        moving = None if known is None else interpolated(t, own, known)
        return Samples(t, interpolated(t, own, self.samples.position), moving)


def _added(vehicle: Quadrotor, samples: Samples, compensation: Drag | None) -> FloatArray:
    """Return the feed-forward of the samples themselves, or that of a model of drag."""
    if samples.feed_forward is not None and compensation is not None:
        raise InputError("the samples state their feed-forward: leave the compensation out")
    if compensation is not None:
        return drag_feed_forward(vehicle, samples, compensation)
    return np.zeros((len(samples), 3)) if samples.feed_forward is None else samples.feed_forward


def check_steps(duration: float, step: float) -> None:
    """Raise TimingError for a flight [s] of more steps [s] than are simulated."""
    if not duration <= MOST_STEPS * step:
        raise TimingError(f"{duration:g} s in steps of {step:g} s are too many: at most {MOST_STEPS} are simulated")


def tabulate(path: Path | Samples, rate: float | None, step: float) -> Samples:
    """Return the setpoints of a path at a rate [Hz], or per step without a rate; samples are not resampled.

    Raises
    ------
    TimingError
        If the rate is not positive, or samples come with a rate.
    InputError
        If it is neither a path nor samples.
    """
    if isinstance(path, Path):
        return path.sample(1.0 / step if rate is None else rate)
    if not isinstance(path, Samples):
        raise InputError(f"the reference is of type {type(path).__name__}: give a path or samples")
    if rate is not None:
        raise TimingError("samples have their own instants: sample the path at that rate, and leave the rate out")
    return path


def _spatial(samples: Samples) -> Samples:
    """Return samples with three coordinates: 3-D ones unchanged, 2-D ones at height 0."""
    if samples.dim == 3:
        return samples
    changed: dict[str, Any] = {name: spatial(values) for name, values in samples.vectors().items()}
    return replace(samples, **changed)
