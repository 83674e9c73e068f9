"""Minimum-snap trajectories, certified inside their corridor at every instant.

The public names are loaded when they are first used, so that importing the package stays quick.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
