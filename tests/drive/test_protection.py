"""The drive's own protections: what trips, when, with which EMCY, and when the fault can be reset."""

from __future__ import annotations

import math

import pytest

MS = 1_000_000
S = 1_000_000_000


def reset(bench) -> None:
    bench.rpdo(0x00, 0)
    bench.rpdo(0x80, 0)


def test_i2t_trips_when_the_lagged_square_of_the_torque_reaches_that_of_the_rated_one(enabled):
    """At u times rated torque from cold: tau ln(u² / (u² - 1)), here tau = 30 s and u = 0.6 / 0.319."""
    enabled.rpdo(0x0F, 12402, 2 * S)
    square = (0.6 / 0.319) ** 2
    due_ns = 2 * S + 50_000 + math.ceil(30e9 * math.log(square / (square - 1)))
    enabled.wait(due_ns - 10)
    assert enabled.emergencies == []
    assert enabled.read(0x2100, 3) == 100
    enabled.wait(due_ns + 10)
    assert [code for _, code in enabled.emergencies] == [0x2350]
    assert enabled.emergencies[0][0] == pytest.approx(due_ns, abs=10)
    assert enabled.torque == 0.0


def test_rated_torque_flows_for_ever(enabled):
    enabled.rpdo(0x0F, 6593)
    enabled.wait(3600 * S)
    assert enabled.emergencies == []


def test_an_i2t_fault_can_be_reset_only_when_the_motor_has_cooled(enabled):
    enabled.rpdo(0x0F, 12402)
    enabled.wait(11 * S)
    tripped_ns = enabled.emergencies[0][0]
    cooled_ns = tripped_ns + int(30e9 * math.log(1 / 0.9))
    enabled.wait(cooled_ns - MS)
    reset(enabled)
    assert enabled.state & 0x4F == 0x08
    enabled.wait(cooled_ns + MS)
    reset(enabled)
    assert enabled.state == 0x40


def test_a_shorter_time_constant_trips_sooner(enabled):
    enabled.write(0x2110, 1000, 4, 2)
    enabled.rpdo(0x0F, 12402)
    enabled.wait(enabled.now_ns + S)
    assert [code for _, code in enabled.emergencies] == [0x2350]


def test_overcurrent_trips_at_once_and_cuts_whatever_605e_says(enabled):
    enabled.write(0x605E, 1, 2)
    enabled.write(0x2110, 1000, 4, 1)  # per mille of rated
    enabled.rpdo(0x0F, 6800, 10 * MS)
    enabled.wait(11 * MS)
    assert enabled.emergencies == [(10 * MS + 50_000, 0x2310)]
    assert enabled.torque == 0.0
    assert enabled.state & 0x4F == 0x08


def test_overspeed_trips_at_the_sync_that_sees_it(enabled, machine):
    machine.velocity[0] = -5001 * math.tau / 60
    enabled.sync(10 * MS)
    assert enabled.emergencies == [(10 * MS, 0x7310)]
    reset(enabled)
    assert enabled.state & 0x4F == 0x08
    machine.velocity[0] = 0.0
    reset(enabled)
    assert enabled.state == 0x40


def test_overspeed_is_seen_without_sync_too(enabled, machine):
    machine.velocity[0] = 5001 * math.tau / 60
    enabled.wait(100 * MS)
    assert [code for _, code in enabled.emergencies] == [0x7310]


def test_undervoltage_trips_when_the_level_is_above_the_dc_link(enabled):
    assert enabled.read(0x6079) == 280_000
    enabled.write(0x2110, 300_000, 4, 4)
    assert [code for _, code in enabled.emergencies] == [0x3220]
    assert not enabled.statusword & 0x0010


@pytest.mark.parametrize(
    ("injection", "code", "register"),
    [(2, 0x7305, 0x21), (3, 0x4310, 0x09), (4, 0x4210, 0x09), (5, 0x3220, 0x05), (6, 0x3210, 0x05)],
)
def test_an_injected_fault_lasts_until_it_is_cleared(enabled, injection, code, register):
    enabled.write(0x2F00, injection, 4)
    assert [code for _, code in enabled.emergencies] == [code]
    assert enabled.read(0x603F) == code
    assert enabled.read(0x1001) == register
    reset(enabled)
    assert enabled.state & 0x4F == 0x08
    assert bool(enabled.statusword & 0x0010) is (injection not in {5, 6})
    enabled.write(0x2F00, 0, 4)
    assert enabled.statusword & 0x5F == 0x18
    reset(enabled)
    assert enabled.state == 0x40


def test_an_injected_overcurrent_happens_once(enabled):
    enabled.write(0x2F00, 1, 4)
    assert [code for _, code in enabled.emergencies] == [0x2310]
    reset(enabled)
    assert enabled.state == 0x40


def test_an_unknown_injection_is_refused_and_the_object_cannot_be_read(bench):
    assert bench.sdo(0x2F00, 0, bytes((99, 0, 0, 0))) == 0x06090030
    bench.hear(0x601, bytes.fromhex("40002F0000000000"))
    assert bench.heard[-1][2] == bytes.fromhex("80002F0001000106")


def test_a_lost_encoder_stands_still_and_finds_its_counts_again(enabled, machine):
    machine.angle[0] = 1.0
    stood = enabled.read(0x6064)
    enabled.write(0x2F00, 2, 4)
    machine.angle[0] = 2.0
    assert enabled.read(0x6064) == stood
    assert enabled.read(0x606C) == 0
    enabled.write(0x2F00, 0, 4)
    assert enabled.read(0x6064) == math.floor(2.0 * 8000 / math.tau)


def test_temperatures_rise_towards_those_of_the_load(make_bench):
    bench = make_bench(device_time_constant=1.0, motor_time_constant=2.0)
    bench.start()
    assert (bench.read(0x2100, 1), bench.read(0x2100, 2)) == (300, 300)
    bench.enable(6593)
    bench.wait(300 * S)
    assert bench.read(0x2100, 1) == pytest.approx(600, abs=2)
    assert bench.read(0x2100, 2) == pytest.approx(1050, abs=4)


def test_an_overheated_motor_trips_and_must_cool_before_the_reset(make_bench):
    bench = make_bench(motor_rise=200.0, motor_time_constant=1.0)
    bench.start()
    bench.enable(6593)
    while not bench.emergencies:
        bench.wait(bench.now_ns + 100 * MS)
    assert [code for _, code in bench.emergencies] == [0x4310]
    reset(bench)
    assert bench.state & 0x4F == 0x08
    bench.wait(bench.now_ns + 100 * S)
    reset(bench)
    assert bench.state == 0x40


def test_an_i2t_fault_whose_reaction_is_a_ramp_is_told_once(enabled):
    enabled.write(0x605E, 2, 2)
    enabled.write(0x2110, 100, 4, 2)
    enabled.rpdo(0x0F, 12402, 10 * MS)
    enabled.wait(S)
    assert [code for _, code in enabled.emergencies] == [0x2350]
    assert enabled.state & 0x4F == 0x08
