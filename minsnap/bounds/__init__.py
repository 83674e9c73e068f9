"""Bounds of the flight time that no curve beats: a costate that proves them, and its check in exact rationals."""
