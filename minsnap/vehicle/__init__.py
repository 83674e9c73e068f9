"""The vehicle: parameters, drag models, fits, equations of motion, and the thrust, rates and torques a motion needs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
