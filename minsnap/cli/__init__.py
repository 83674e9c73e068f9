"""The ``minsnap`` command; each module of this package registers its commands with the application."""

from minsnap.cli.app import main

__all__ = ["main"]
