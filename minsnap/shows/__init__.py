"""Files of whole fleets, and shows: formations, the flights between them, lights, the report of what is certified."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
