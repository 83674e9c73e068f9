"""The vehicle: parameters, drag models, fits, equations of motion, and the thrust, rates and torques a motion needs."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
