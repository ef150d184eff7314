"""Least squares on a record in time: values and intervals that allow for residuals that hang together.

Residuals of neighbouring samples share the samples of one differentiating window, so n of them tell less than n
independent ones. The covariance is Newey and West's (Econometrica 55(3), 1987): with row scores s_k = Y_k' r_k

    cov = (Y'Y)^-1 [ G_0 + sum_{l=1..L} (1 - l / (L + 1)) (G_l + G_l') ] (Y'Y)^-1 ,   G_l = sum_k s_k s_{k-l}'

Rows that are left out have the score 0, so that lags stay times. The intervals take Student's quantile with the
degrees of freedom that are left when 2 L / 3 + 1 rows in touch count as one.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

Array = NDArray[np.float64]

CONFIDENCE: Final = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What least squares found.

    Attributes:
        values: Shape (p,).
        covariance: Of the values, shape (p, p).
        low: Begin of each value's interval of confidence, shape (p,).
        high: Its end.
        residuals: Of the rows that were kept, shape (m, d).
        effective: How many independent rows they are worth.
    """

    values: Array
    covariance: Array
    low: Array
    high: Array
    residuals: Array
    effective: float

    @property
    def residual_rms(self) -> float:
        """Root mean square of all residuals."""
        return math.sqrt(float(np.mean(self.residuals**2)))

    def shifted(self, by: Array) -> "Fit":
        """The same fit of values that are counted from elsewhere, shape (p,)."""
        return replace(self, values=self.values + by, low=self.low + by, high=self.high + by)


def least_squares_in_time(Y: Array, force: Array, kept: NDArray[np.bool_], *, lags: int) -> Fit:
    """The values that fit best, and how well they are known.

    Args:
        Y: Regressor of each instant, shape (n, d, p).
        force: What it is to give, shape (n, d).
        kept: Which instants count, shape (n,).
        lags: L, instants over which residuals may hang together.

    Returns:
        Values, covariance, intervals, residuals.

    Raises:
        ValueError: The kept instants do not determine the values.
    """
    rows, right = Y[kept], force[kept]
    unknowns = Y.shape[-1]
    design = rows.reshape(-1, unknowns)
    blocks = math.ceil(len(rows) / (2 * lags / 3 + 1))
    if blocks * Y.shape[1] <= unknowns or np.linalg.matrix_rank(design) < unknowns:
        raise ValueError(f"{len(rows)} samples that can be used do not determine {unknowns} unknowns")
    values = np.asarray(np.linalg.lstsq(design, right.ravel(), rcond=None)[0], dtype=np.float64)
    residuals: Array = right - rows @ values
    scores = np.zeros((len(Y), unknowns))
    scores[kept] = np.einsum("kdp,kd->kp", rows, residuals)
    inverse = np.linalg.inv(design.T @ design)
    freedom = blocks * Y.shape[1] - unknowns
    covariance = inverse @ long_run(scores, lags) @ inverse * (blocks * Y.shape[1] / freedom)
    half = float(student.ppf(0.5 + CONFIDENCE / 2, freedom)) * np.sqrt(np.diag(covariance))
    return Fit(values, covariance, values - half, values + half, residuals, float(blocks))


def long_run(scores: Array, lags: int) -> Array:
    """Newey and West's sum of a series' covariances over lags, shape (p, p), from scores of shape (n, p)."""
    total: Array = scores.T @ scores
    for lag in range(1, min(lags, len(scores) - 1) + 1):
        at_lag = scores[lag:].T @ scores[:-lag]
        total = total + (1.0 - lag / (lags + 1)) * (at_lag + at_lag.T)
    return total
