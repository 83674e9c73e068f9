"""Where paths come from: shapes, maps with ways through them, courses and missions."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
