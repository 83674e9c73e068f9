"""Minimum-snap trajectories in ROS 2."""
