"""The published measurements of the thesis, their fits, and its experiment repeated in simulation."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
