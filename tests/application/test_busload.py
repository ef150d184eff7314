"""The bus-load calculator: the specification's figures, and the simulated wire that bears them out."""

import json

import pytest

from torquerig.bus_trial import attempt
from torquerig.busload import Plan, budget, budgets, group_frames
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.errors import ConfigurationError


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


def test_each_bus_of_several_has_its_own_load():
    plan = Plan(drives=3, buses=2, rate_hz=1000)
    assert plan.spread == (2, 1)
    assert [each.cycle_bits for each in budgets(plan)] == pytest.approx([515, 285])
    # heartbeats of all four nodes are on every bus: what siblings need of each other is passed on
    assert [each.load - each.cyclic_load for each in budgets(plan)] == pytest.approx([4 * 20 * 65 / 1e6] * 2)


@pytest.mark.parametrize(("buses", "fastest_hz"), [(1, 1e9 / 480e3 / 2), (2, 1e9 / 345e3 / 2), (3, 1e9 / 210e3 / 2)])
def test_every_bus_more_lets_the_cycle_be_faster(buses, fastest_hz):
    assert budget(Plan(buses=buses)).fastest_hz == pytest.approx(fastest_hz)


def test_a_rate_at_which_tpdos_come_too_late_does_not_fit_however_empty_the_bus():
    taken = budget(Plan(rate_hz=1600, tpdo_bytes=4, group_rpdo=True))
    assert taken.cyclic_load < 0.8
    assert not taken.fits
    assert attempt(taken.plan).tpdo_us is None
    with pytest.raises(ConfigurationError, match="the last TPDO comes 360 us after SYNC, and the driver waits half a"):
        load_configuration(options={"loop.rate_hz": 1562.5, "loop.group_rpdo": True})


def test_a_group_rpdo_goes_to_every_bus_with_all_torques():
    (row,) = (row for row in budget(Plan(buses=3, group_rpdo=True)).rows if row.name == "group RPDO")
    assert row.data_bytes == 6


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


def test_at_2_khz_three_wires_are_on_time_where_one_and_two_are_not():
    late = [attempt(Plan(rate_hz=2000, buses=buses)).late for buses in (1, 2, 3)]
    assert min(late[:2]) > 190
    trial = attempt(Plan(rate_hz=2000, buses=3))
    assert (trial.late, trial.waiting, trial.tpdo_us, trial.rpdo_us) == (0, 0, 210.0, 305.0)


def test_the_command_says_whether_it_fits(capsys):
    assert main(["busload", "--rate", "1000", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fits"] is True
    assert main(["busload", "--rate", "2000"]) == 0
    said = capsys.readouterr().out
    assert "It does not fit" in said
    assert "516 frames still waited" in said
    assert main(["busload", "--buses", "4"]) == 2
    assert "3 drives on 4 buses" in capsys.readouterr().err
