"""Datasets of plans: many problems over the processes of a machine or a cluster, as Parquet."""

from minsnap.basics.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
