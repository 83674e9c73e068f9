"""Replanning in flight: from a moving start, within a budget of time, with a way to stop."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
