"""The published drag surfaces, exactly as printed, and their force in flight.

Source: *Effect of Incorporating Aerodynamic Drag Model on Trajectory Tracking Performance of DJI F330 Quadcopter*
(Arizona State University), sections 3.3 and 3.4. Its angles are in degrees, its rotor speeds in revolutions per minute.
The parasitic fit starts at 7 m/s: below 4.7 m/s its reduced forms are negative, that is, they push forward, and no form
is zero at rest. They are kept as printed for comparison; use :func:`minsnap.flight.thesis.consistent_parasitic_drag`
for compensation.
"""

from __future__ import annotations

import numpy as np

from minsnap.errors import VehicleError
from minsnap.vehicle.surface import Surface, SurfaceDrag

_TUNNEL = {"pitch_deg": (-20.0, 20.0), "velocity": (7.0, 28.0)}

PUBLISHED_PARASITIC = Surface(
    "the published parasitic surface",
    ("pitch_deg", "velocity"),
    ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)),
    np.array([-0.1069, -0.01293, -0.01856, 0.001505, 0.001185, 0.008744]),
    _TUNNEL,
    0.9915,
)
"""Drag of the bare airframe from pitch and velocity (section 3.3.2)."""

PUBLISHED_PARASITIC_REDUCED = Surface(
    "the published parasitic curve",
    ("velocity",),
    ((0,), (1,), (2,)),
    np.array([-0.1069, -0.01856, 0.008744]),
    {"velocity": (7.0, 28.0)},
)
"""The same without its pitch terms (section 3.3.3)."""

PUBLISHED_PARASITIC_LINEAR = Surface(
    "the published linear parasitic model",
    ("velocity",),
    ((0,), (1,)),
    np.array([-0.1069, -0.01856]),
    {"velocity": (7.0, 28.0)},
)
"""The same without the square of velocity: what the thesis compensated with (section 3.3.3)."""

PUBLISHED_PROPELLER = Surface(
    "the published propeller surface",
    ("pitch_deg", "velocity", "speed_rpm"),
    ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 0, 2)),
    np.array([0.36891, -0.041098, 0.041432, -0.00024171, 1.8526e-5, -1.1287e-11]),
    {"pitch_deg": (0.0, 90.0), "velocity": (0.0, 15.0)},
    0.976,
)
"""Drag of one propeller from pitch, velocity and rotor speed (section 3.4.2)."""


def published_drag(name: str = "linear") -> SurfaceDrag:
    """Return a published model as a force: ``surface``, ``reduced``, ``linear`` or ``propeller``."""
    models = {
        "surface": SurfaceDrag(PUBLISHED_PARASITIC),
        "reduced": SurfaceDrag(PUBLISHED_PARASITIC_REDUCED),
        "linear": SurfaceDrag(PUBLISHED_PARASITIC_LINEAR),
        "propeller": SurfaceDrag(PUBLISHED_PROPELLER, count=4),
    }
    if name not in models:
        raise VehicleError(f"no published drag model is called {name!r}: choose from {', '.join(models)}")
    return models[name]
