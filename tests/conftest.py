"""How hypothesis runs: the same examples every time under continuous integration, new ones elsewhere."""

import os

from hypothesis import HealthCheck, settings

COMMON = {"deadline": None, "max_examples": 30, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("local", print_blob=True, **COMMON)
settings.register_profile("ci", derandomize=True, **COMMON)
settings.load_profile("ci" if os.environ.get("CI") else "local")
