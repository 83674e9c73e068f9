"""Limits of a vehicle on the derivatives of its path, and how far a path uses them."""
