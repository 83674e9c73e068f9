"""Missions: courses of waypoints and gates from files, flown with take-off, run-up, laps, holds and landing."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
