"""Tracking: how well a flight followed its reference."""
