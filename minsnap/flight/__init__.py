"""Flying and what was flown: simulation, tracking, MAVLink, motion capture and the experiment of the thesis.

Each public name belongs to the folder that it comes from, and both ways of importing it give the same object.
"""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
