"""One RPDO for all drives: the same motion with 40 % fewer bits."""

import pytest

from torquerig import load_configuration, run_experiment
from torquerig.errors import ConfigurationError


def test_the_motion_is_the_same_and_the_bus_load_is_not():
    own, shared = (
        run_experiment(load_configuration(options={"loop.group_rpdo": group_rpdo})).summary
        for group_rpdo in (False, True)
    )
    assert shared.position_rmse_mm == pytest.approx(own.position_rmse_mm, rel=0.02)
    assert shared.bus_load < 0.75 * own.bus_load
    assert shared.overruns == 0


def test_it_goes_faster_than_rpdos_of_their_own_could():
    assert run_experiment(load_configuration(options={"loop.group_rpdo": True, "loop.rate_hz": 1250.0})).summary
    with pytest.raises(ConfigurationError, match="3 RPDOs a cycle would load"):
        load_configuration(options={"loop.rate_hz": 1250.0})
    with pytest.raises(ConfigurationError, match="one RPDO a cycle would load"):
        load_configuration(options={"loop.group_rpdo": True, "loop.rate_hz": 2000.0})
