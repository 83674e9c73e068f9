"""Several vehicles on one clock: how far apart they stay, proved, and plans that keep them apart."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
