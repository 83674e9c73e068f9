"""Streaming of setpoints to PX4 and ArduPilot over MAVLink."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
