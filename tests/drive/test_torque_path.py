"""From counts to torque: gains and their signs, limits, saturation, offset, sources, latency, and the way back."""

from __future__ import annotations

import pytest

MS = 1_000_000
US = 1_000


@pytest.fixture
def strong(make_bench):
    """A drive whose current loop could give 2 N·m, so that 1 N·m is not cut off; limits at their highest."""
    bench = make_bench(peak_torque=2.0)
    bench.write(0x6076, 400, 4)
    bench.start()
    bench.enable()
    return bench


def command(bench, counts: int) -> None:
    bench.rpdo(0x0F, counts)
    bench.wait(bench.now_ns + MS)


def test_20670_counts_are_1_newton_metre_and_minus_19528_are_minus_1(strong):
    command(strong, 20670)
    assert strong.torque == 1.0
    command(strong, -19528)
    assert strong.torque == -1.0


def test_the_actual_torque_is_told_in_the_counts_that_command_it(strong):
    for counts in (20670, -19528, 3500, -3500):
        command(strong, counts)
        assert strong.sync()[2] == counts
        assert strong.read(0x2077) == counts


def test_the_actual_torque_in_per_mille_is_of_rated_torque_by_the_nominal_scale(enabled):
    """100 per mille of 0.319 N·m are 641.19 counts at 20100 counts per N·m."""
    command(enabled, 641)
    assert enabled.read(0x6077) == 100
    assert enabled.read(0x6078) == 100
    assert enabled.read(0x6074) == 100


def test_the_current_loop_saturates_at_its_peak_in_newton_metres(make_bench):
    bench = make_bench(peak_torque=0.494)
    bench.start()
    bench.enable()
    command(bench, 19000)
    assert bench.torque == pytest.approx(0.494, rel=1e-12)
    assert bench.statusword & 0x0800
    command(bench, -19000)
    assert bench.torque == pytest.approx(-0.494, rel=1e-12)
    command(bench, 100)
    assert not bench.statusword & 0x0800


@pytest.mark.parametrize(
    ("index", "counts", "limited_counts"),
    [(0x6072, 6000, 3205.95), (0x6072, -6000, -3205.95), (0x60E0, 6000, 3205.95), (0x60E1, -6000, -3205.95)],
)
def test_6072_limits_both_directions_60e0_the_positive_and_60e1_the_negative(enabled, index, counts, limited_counts):
    """500 per mille of 0.319 N·m at 20100 counts per N·m are 3205.95 counts."""
    enabled.write(index, 500, 2)
    command(enabled, counts)
    assert enabled.drive.torque_demand == pytest.approx(limited_counts)
    assert enabled.statusword & 0x0800
    if index != 0x6072:
        command(enabled, -counts)
        assert enabled.drive.torque_demand == -counts


def test_a_limit_acts_on_a_torque_that_flows(enabled):
    command(enabled, 6000)
    enabled.write(0x6072, 500, 2)
    enabled.wait(enabled.now_ns + MS)
    assert enabled.drive.torque_demand == pytest.approx(3205.95)


def test_the_torque_source_0_takes_6071_in_per_mille_of_6076(enabled):
    enabled.write(0x2070, 0, 1)
    enabled.write(0x6071, -250, 2)
    enabled.wait(enabled.now_ns + MS)
    assert enabled.drive.torque_demand == pytest.approx(-250 * 0.319e-3 * 20100)
    assert enabled.torque == pytest.approx(-250 * 0.319e-3 * 20100 / 19528)


def test_the_torque_offset_is_added_in_per_mille(enabled):
    enabled.write(0x60B2, 100, 2)
    command(enabled, 1000)
    assert enabled.drive.torque_demand == pytest.approx(1000 + 641.19)


def test_an_rpdo_of_type_255_acts_after_the_drives_latency_exactly(enabled, machine):
    enabled.rpdo(0x0F, 2067, 10 * MS)
    enabled.wait(20 * MS)
    assert machine.commands[-1] == (10 * MS + 50 * US, 0, 0.1)


def test_rpdos_that_come_faster_than_the_latency_all_act_after_it(enabled, machine):
    machine.commands.clear()
    for k in range(4):
        enabled.rpdo(0x0F, 2067 * (k + 1), 10 * MS + k * 20 * US)
    enabled.wait(20 * MS)
    assert [at_ns - 10 * MS for at_ns, _, _ in machine.commands] == [50 * US, 70 * US, 90 * US, 110 * US]


def test_an_rpdo_of_type_1_acts_at_the_next_sync_exactly_and_shows_at_the_one_after(bench, machine):
    bench.write(0x1400, 1, 1, 2)
    for k, controlword in enumerate((0x06, 0x07, 0x0F)):
        bench.rpdo(controlword, 0, 10 * k * MS)
        bench.sync(10 * k * MS + 4 * MS)
    bench.rpdo(0x0F, 2067, 41 * MS)
    assert bench.sync(44 * MS)[2] == 0
    assert machine.commands[-1] == (44 * MS, 0, 0.1)
    assert bench.sync(48 * MS)[2] == 2067


def test_the_command_latency_is_told_from_sync_to_effect(enabled):
    enabled.sync(10 * MS)
    enabled.rpdo(0x0F, 100, 13 * MS)
    enabled.wait(14 * MS)
    assert enabled.read(0x2100, 4) == 3050


def test_a_cut_forgets_targets_that_have_not_acted(enabled):
    enabled.rpdo(0x0F, 3000)
    enabled.rpdo(0x00, 3000)
    enabled.wait(enabled.now_ns + 10 * MS)
    assert enabled.torque == 0.0


def test_torque_is_zero_in_every_state_but_operation_enabled(bench):
    for controlword in (0x06, 0x07):
        bench.rpdo(controlword, 5000)
        bench.wait(bench.now_ns + MS)
        assert bench.torque == 0.0


def test_what_sync_releases_is_not_undone_by_an_older_rpdo_that_has_yet_to_act(enabled, machine):
    """RPDO1 (type 255) comes 20 us before the SYNC that releases the torque offset of RPDO2 (type 1)."""
    enabled.write(0x1601, 0x60B20010, 4, 1)
    enabled.write(0x1601, 1, 1, 0)
    enabled.write(0x1401, 1, 1, 2)
    enabled.write(0x1401, 0x301, 4, 1)
    enabled.hear(0x301, b"\x64\x00", 9 * MS)
    enabled.rpdo(0x0F, 1000, 10 * MS - 20 * US)
    machine.commands.clear()
    enabled.sync(10 * MS)
    enabled.wait(11 * MS)
    assert [at_ns for at_ns, _, _ in machine.commands] == [10 * MS]
    assert enabled.drive.torque_demand == pytest.approx(1641.19)
