"""Bags of ROS 2, read without ROS: storage, messages, and the flight that they hold."""
