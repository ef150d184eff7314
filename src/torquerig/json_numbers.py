"""Numbers as JSON can hold them: it knows neither NaN nor infinity."""

import math


def finite(value: object) -> object:
    """A value as JSON can hold it: each NaN or infinity in it, at any depth, turned into None."""
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def finite_number(value: float | None) -> float | None:
    """A number, or None if it is none."""
    return float(value) if value is not None and math.isfinite(value) else None
