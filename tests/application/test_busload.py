"""The bus-load calculator: the specification's figures, and the simulated wire that bears them out."""

import json

import pytest

from torquerig.bus_trial import attempt
from torquerig.busload import Plan, budget, group_frames
from torquerig.cli import main


def test_a_cycle_of_three_drives_takes_745_bits():
    taken = budget(Plan())
    assert taken.cycle_bits == pytest.approx(745)
    assert taken.cyclic_load == pytest.approx(0.18625)
    assert budget(Plan(rate_hz=1000)).cyclic_load == pytest.approx(0.745)


def test_with_the_group_rpdo_and_positions_alone_it_takes_455_bits():
    taken = budget(Plan(rate_hz=2000, tpdo_bytes=4, group_rpdo=True))
    assert taken.cycle_bits == pytest.approx(455)
    assert taken.cyclic_load == pytest.approx(0.91)
    assert not taken.fits


def test_drives_spread_over_buses_count_where_most_of_them_are():
    assert budget(Plan(drives=10, buses=4)).cycle_bits == budget(Plan(drives=3)).cycle_bits


@pytest.mark.parametrize(("drives", "lengths"), [(1, [2]), (3, [6]), (4, [8]), (9, [8, 8, 2])])
def test_a_group_rpdo_carries_up_to_four_torques(drives, lengths):
    assert group_frames(drives) == lengths


@pytest.mark.parametrize("plan", [{"drives": 1, "buses": 2}, {"drives": 128}, {"rate_hz": 0}, {"tpdo_bytes": 9}])
def test_what_cannot_be_is_refused(plan):
    with pytest.raises(ValueError, match=r"bus|positive|bytes"):
        budget(Plan(**plan))


def test_what_fits_is_on_time_on_the_simulated_wire_to_the_microsecond():
    trial = attempt(Plan(rate_hz=1000))
    assert (trial.late, trial.waiting) == (0, 0)
    assert trial.tpdo_us == pytest.approx(55 + 20 + 3 * 135)  # SYNC, the drives' time, three TPDOs
    assert trial.rpdo_us == pytest.approx(trial.tpdo_us + 3 * 95)


def test_what_does_not_fit_piles_up_on_the_simulated_wire():
    trial = attempt(Plan(rate_hz=2000))
    assert trial.late > 190
    assert trial.waiting > 400


def test_the_command_says_whether_it_fits(capsys):
    assert main(["busload", "--rate", "1000", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fits"] is True
    assert main(["busload", "--rate", "2000"]) == 0
    said = capsys.readouterr().out
    assert "It does not fit" in said
    assert "516 frames still waited" in said
    assert main(["busload", "--buses", "4"]) == 2
    assert "3 drives on 4 buses" in capsys.readouterr().err
