"""Routes: maps read from files, ways through them, and plans whose distance to what is occupied is known."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
