from .paths.routes import *  # noqa: F403
