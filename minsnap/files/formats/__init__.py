"""Formats of other programs: Crazyflie, mav_trajectory_generation, ROS, PX4, NumPy, pandas."""
