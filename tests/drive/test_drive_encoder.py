"""The encoder: edges at fixed angles, zero at power-on, 32 bits, latched at SYNC."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.device_sim.drive.encoder import wrap

MS = 1_000_000
EDGE = math.tau / 8000  # 2000 P/R x 4


def turn(machine, counts: float) -> None:
    machine.angle[0] = counts * EDGE


def test_the_count_is_zero_at_power_on_wherever_the_machine_stands(machine, make_bench):
    turn(machine, 12345.25)
    bench = make_bench()
    assert bench.read(0x6064) == 0


def test_edges_stand_at_absolute_angles_so_the_first_count_depends_on_where_the_shaft_stood(machine, make_bench):
    turn(machine, 100.75)
    bench = make_bench()
    turn(machine, 100.99)
    assert bench.read(0x6064) == 0
    turn(machine, 101.01)
    assert bench.read(0x6064) == 1
    turn(machine, 99.99)
    assert bench.read(0x6064) == -1


def test_a_motor_revolution_is_8000_counts(machine, bench):
    machine.angle[0] = 25 * math.tau + EDGE / 2
    assert bench.read(0x6064) == 200_000


@pytest.mark.parametrize(("counts", "position"), [(2**31 - 1, 2**31 - 1), (2**31, -(2**31)), (-(2**31) - 1, 2**31 - 1)])
def test_the_position_wraps_around_like_32_bits(machine, bench, counts, position):
    turn(machine, counts + 0.5)
    assert bench.read(0x6063) == position
    assert bench.sync()[1] == position


@given(st.integers())
def test_wrapping_keeps_the_value_modulo_2_to_the_32(value):
    assert (wrap(value) - value) % 2**32 == 0
    assert -(2**31) <= wrap(value) < 2**31


def test_tpdo1_tells_the_position_at_the_sync_and_when_that_was(machine, bench):
    turn(machine, 7.5)
    assert bench.sync(4 * MS)[1] == 7
    turn(machine, 9.5)
    assert bench.heard[-1][0] == 4 * MS + 20_000
    assert bench.drive.store.get(0x2130) == 4000


def test_the_velocity_is_told_in_counts_per_second(machine, bench):
    machine.velocity[0] = -math.tau * 75
    assert bench.read(0x606C) == -600_000


def test_the_position_follows_the_users_units(machine, bench):
    """A feed of 360000 in 25 motor revolutions: 1.8 units a count, rounded down."""
    bench.write(0x6092, 360_000, 4, 1)
    turn(machine, 3.5)
    assert (bench.read(0x6064), bench.read(0x6063)) == (5, 3)
    machine.velocity[0] = 10 * EDGE
    assert bench.read(0x606C) == 18


def test_the_drive_time_counts_from_power_on(make_bench):
    bench = make_bench()
    bench.wait(3 * MS)
    bench.drive.power_cycle(5 * MS)
    bench.wait(5 * MS)
    bench.start()
    bench.sync(6 * MS)
    assert bench.drive.store.get(0x2130) == 1000
