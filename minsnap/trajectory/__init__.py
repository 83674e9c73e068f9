"""Trajectories: the path every other part takes or gives, its heading, its samples and the report of its plan."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
