"""Simulation: a quadrotor under a controller, with sensors, motors and wind."""
