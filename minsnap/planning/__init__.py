"""The call ``plan`` that ties everything together, and ``plan_many`` for many problems over threads."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
