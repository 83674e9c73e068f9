"""Drag feed-forward: the acceleration to add to the reference to compensate drag."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_able, check_kind
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
    still = np.zeros((len(reference), 3))
    velocity, acceleration, jerk, snap = (
        still if value is None else spatial(value)
        for value in (reference.velocity, reference.acceleration, reference.jerk, reference.snap)
    )
    level = np.zeros(len(reference))
    yaw = level if reference.yaw is None else reference.yaw
    rate = level if reference.yaw_rate is None else reference.yaw_rate
    flat = drag if isinstance(drag, BodyDrag) else BodyDrag()
    return flat_states(vehicle, velocity, acceleration, jerk, snap, yaw, rate, drag=flat)


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
    velocity = np.einsum("mji,mj->mi", states.rotation, spatial(reference.velocity))
    pitch = -np.arcsin(np.clip(states.rotation[:, 2, 0], -1.0, 1.0))
    force = drag.force(velocity, pitch=pitch, rotor_speed=states.rotor_speed)
    return np.asarray(-np.einsum("mij,mj->mi", states.rotation, force) / vehicle.mass)
