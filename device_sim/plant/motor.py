"""Kernels of the current loop: torque follows demand with a first-order lag, solved exactly."""

from math import exp, log1p, pow
from typing import Final

from torquerig.mechanism.compiled import compiled

NEVER: Final = float("inf")

_RESOLVED: Final = 3e-5
"""Torque change [N·m] whose decay RK4 may cross in steps of one lag; error grows with the fifth power of the step."""

EXCESS: Final = 1e-9
"""A joint breaks away at this much, relative, beyond its limit: it then surely accelerates the right way."""


@compiled
def remaining_share(duration: float, lag: float) -> float:
    """What is left of torque minus demand after `duration`: exp(-duration / lag), 0 without lag."""
    return exp(-duration / lag) if duration > 0.0 else 1.0


@compiled
def step_length(step: float, lag: float, change: float) -> float:
    """The longest step that resolves a torque still `change` [N·m] away from its demand."""
    if lag <= 0.0 or change <= 0.0:
        return step
    return min(step, lag * pow(_RESOLVED / change, 0.2))


@compiled
def crossing_time(lag: float, now: float, later: float, limit: float) -> float:
    """When a load that lags from `now` to `later` leaves [-limit, limit]; 0 if it is outside, NEVER if it stays."""
    bound = limit * (1.0 + EXCESS)
    if abs(now) > bound:
        return 0.0
    if abs(later) <= bound:
        return NEVER
    share = ((bound if later > 0.0 else -bound) - now) / (later - now)
    return -lag * log1p(-share) if share < 1.0 else NEVER
