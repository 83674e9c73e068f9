"""The compiled core: C++17 behind ``extern "C"``, loaded with ctypes by ``library.py`` alone.

Problems that it cannot solve or cannot prove are solved by the Python core, which stays the reference.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
