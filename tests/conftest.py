"""What every test stands on: hypothesis without deadlines, because the machines are shared and noisy; vcan's mark."""

import sys
from pathlib import Path

from hypothesis import HealthCheck, settings

sys.path.insert(0, str(Path(__file__).parent / "vcan"))

from forward import pytest_configure as pytest_configure  # noqa: PLC0414 a hook, to be found here

settings.register_profile("shared", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared")
