"""Missions: courses of waypoints and gates from files, flown with take-off, run-up, laps, holds and landing."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
