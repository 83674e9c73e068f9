"""Routes: maps read from files, ways through them, and plans whose distance to what is occupied is known."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
