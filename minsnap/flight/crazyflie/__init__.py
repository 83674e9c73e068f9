"""Crazyflies over CRTP: trajectories into their memory, and the commands that fly them."""
