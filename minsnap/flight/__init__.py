"""Flying and what was flown: simulation, tracking, MAVLink and motion capture.

Each public name belongs to the folder that it comes from, and both ways of importing it give the same object.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
