"""Formats of other programs: Crazyflie, mav_trajectory_generation, ROS, PX4, NumPy, pandas."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
