"""Several vehicles on one clock: how far apart they stay, proved, and plans that keep them apart."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
