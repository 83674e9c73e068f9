"""Datasets of plans: many problems over the processes of a machine or a cluster, as Parquet."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
