"""Files of whole fleets, and shows: formations, the flights between them, lights, the report of what is certified."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
