"""Internal preload through the whole chain: law, frames, drives, machine."""

import sys
import textwrap

import numpy as np
import pytest

from torquerig import load_configuration, run_experiment
from torquerig.control import laws

LAW = """
    from dataclasses import dataclass
    from typing import ClassVar

    from torquerig.control.laws.augmented_pd import AugmentedPD
    from torquerig.mechanism.distribution import preload_direction


    @dataclass(frozen=True, slots=True)
    class Strained(AugmentedPD):
        name: ClassVar[str] = "strained-augmented-pd"

        def torque(self, state, desired):
            held_at = state.position + (2.81e-3 + 2e-3) * state.velocity
            return super(Strained, self).torque(state, desired) + 0.15 * preload_direction(self.model, held_at)
"""


@pytest.fixture
def strained_law(tmp_path, monkeypatch):
    """The law, in a file dropped into the laws' package."""
    monkeypatch.setattr(laws, "__path__", [*laws.__path__, str(tmp_path)])
    (tmp_path / "dropped_strained.py").write_text(textwrap.dedent(LAW))
    yield "strained-augmented-pd"
    del sys.modules["torquerig.control.laws.dropped_strained"]


def test_a_preload_hardly_moves_a_frictionless_machine(strained_law):
    """The direction is that of the middle of the hold, which begins 2.81 ms after the sample and lasts 4 ms.

    The drives are exact: one whose gain differs up and down would not give the preload that was asked for.
    """

    def run(law):
        exact = {"simulator.plant": "ideal", "drive.gain_positive": 20100.0, "drive.gain_negative": 20100.0}
        return run_experiment(load_configuration(options=exact | {"loop.law": law, "loop.command_after": 2.81}))

    plain, strained = run("augmented-pd"), run(strained_law)
    rows = plain.log.in_motion
    torques = np.linalg.norm(strained.log.tau - plain.log.tau, axis=1)[rows]
    moved = np.linalg.norm(strained.truth - plain.truth, axis=1)[rows]
    assert torques.mean() == pytest.approx(0.15, rel=0.05)
    assert moved.max() < 25e-6
    assert plain.summary.position_rmse_mm > 0.3
    assert strained.summary.position_rmse_mm == pytest.approx(plain.summary.position_rmse_mm, rel=0.02)
