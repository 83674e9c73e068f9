"""Shapes as what they are to a plan: polynomials of a proved error, and a pace within limits."""

from __future__ import annotations

from dataclasses import replace

from minsnap.limits.limits import Limits, check_limits
from minsnap.time_allocation.time_stretch import touching_factor
from minsnap.trajectory.phase import PhasePath
from minsnap.trajectory.polynomial_form import ERROR, as_polynomials
from minsnap.trajectory.trajectory import Trajectory


class Shape(PhasePath):
    """A circle, a helix or a lemniscate.

    It is sampled by its formula; where polynomials are wanted, to certify it or to join it with a plan, it is replaced
    by some that are within a micrometre.
    """

    def as_trajectory(self, error: float = ERROR) -> Trajectory:
        """Return the shape as polynomials that differ from it by ``error`` [m] at most; see :func:`as_polynomials`."""
        return as_polynomials(self, error)

    def within(self, limits: Limits) -> Shape:
        """Return the same shape flown as fast as limits allow: one of them is just reached, none exceeded.

        Raises
        ------
        LimitError
            If a limit is exceeded at any pace.
        """
        check_limits(limits)
        factor = touching_factor(limits, self.as_trajectory())
        slower = replace(self, law=replace(self.law, rate=self.law.rate / factor))
        return replace(slower, yaw=self.yaw.by_rule(slower))
