"""The reference for estimators where nobody knows the truth."""

import numpy as np
import pytest

from torquerig.control.estimators import THESIS_SAMPLING, Sampling, load_estimators, make_estimator
from torquerig.control.smoother import smoothed_rates

EVEN = np.arange(300) * 1_000_000
SKIPPED = np.delete(EVEN, [50, 120, 121, 122, 200])


@pytest.mark.parametrize("at_ns", [EVEN, SKIPPED])
def test_an_even_acceleration_is_smoothed_without_an_error(at_ns):
    seconds = at_ns * 1e-9
    rates = smoothed_rates(at_ns, 25.0 * seconds[:, None] ** 2, THESIS_SAMPLING, jerk_noise=1e6)
    assert rates[5:-5, 0] == pytest.approx(50.0 * seconds[5:-5], abs=1e-3)


@pytest.mark.parametrize("at_ns", [EVEN, SKIPPED])
def test_no_estimator_of_the_loop_comes_nearer_to_the_truth(at_ns):
    sampling = Sampling(1_000_000, THESIS_SAMPLING.resolution)
    seconds = at_ns * 1e-9
    angles, true_rates = 0.1 * np.sin(40.0 * seconds), 4.0 * np.cos(40.0 * seconds)
    counts = (np.floor(angles / sampling.resolution) * sampling.resolution)[:, None]
    inner = slice(20, -20)
    smoothed = smoothed_rates(at_ns, counts, sampling, jerk_noise=1.4e6)[inner, 0]
    error = np.std(smoothed - true_rates[inner])
    for name in load_estimators():
        estimator = make_estimator(name, 1, sampling)
        estimates = np.array([estimator.update(q, at)[0] for q, at in zip(counts, at_ns.tolist(), strict=True)])
        assert error < 0.7 * np.std(estimates[inner] - true_rates[inner]), name
