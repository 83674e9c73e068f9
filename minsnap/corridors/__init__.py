"""Corridors: the convex sets that a leg must stay in, and the regions of its knots."""
