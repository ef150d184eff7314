"""What every test stands on: hypothesis without deadlines, because the machines are shared and noisy."""

from hypothesis import HealthCheck, settings

settings.register_profile("shared", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared")
