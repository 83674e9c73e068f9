"""Limits of a vehicle on the derivatives of its path, and their utilisation by a path."""
