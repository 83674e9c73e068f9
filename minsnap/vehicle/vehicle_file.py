"""Read and write a vehicle as YAML; the methods of :class:`~minsnap.vehicle.Quadrotor` as functions."""

from __future__ import annotations

import os

from minsnap.vehicle.quadrotor import Quadrotor


def read_vehicle(path: str | os.PathLike[str]) -> Quadrotor:
    """Read a vehicle from YAML; see :func:`minsnap.vehicle.yaml.read_described` for the fields and the errors."""
    return Quadrotor.from_yaml(path)


def write_vehicle(vehicle: Quadrotor, path: str | os.PathLike[str]) -> None:
    """Write a vehicle as YAML in one atomic step; reading it returns exactly the same numbers."""
    vehicle.to_yaml(path)
