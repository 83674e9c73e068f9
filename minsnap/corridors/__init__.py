"""Corridors: the convex sets that a leg must stay in, and where its knots may be."""
