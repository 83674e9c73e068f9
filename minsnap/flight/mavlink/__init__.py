"""Streaming of setpoints to PX4 and ArduPilot over MAVLink."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
