"""Each benchmark runs with tiny counts and gives the JSON that it promises; what is compared does the same work."""

import json

import mujoco
import numpy as np
import pytest
from click.testing import CliRunner

from torquerig.benchmarks import harness, law, lockstep, loop, plant, plant_mujoco, wire
from torquerig.benchmarks.plain import PlainManipulator
from torquerig.cli.app import app
from torquerig.control.laws import load_laws
from torquerig.driver.errors import BusUrlError
from torquerig.mechanism import HOME, Manipulator

TINY = ("--turns", "2", "--turn", "0.001")


def bench(*arguments: str) -> dict:
    result = CliRunner().invoke(app, ["bench", *arguments, "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    return json.loads(result.stdout)


def test_turns_alternate_and_are_compared_within_the_same_turn():
    order = []

    def variant(name, ns):
        def turn(executions):
            order.append(name)
            return executions * next(ns)

        return turn

    slow, quick = iter([100] * 3 + [300, 600, 90]), iter([50] * 3 + [100, 200, 30])
    timings = harness.take_turns({"slow": variant("s", slow), "quick": variant("q", quick)}, turns=3, turn_s=1e-6)
    assert "".join(order) == "sssqqq" + "sq" * 3
    assert timings.ratio("slow", "quick") == pytest.approx(3)
    assert (timings.median_us("slow"), timings.best_us("quick")) == (0.3, 0.03)


def test_law_tells_each_law_in_the_loop_and_in_numpy_and_the_four_inverse_dynamics():
    figures = bench("law", *TINY)
    assert set(figures["laws"]) == set(load_laws())
    assert all(cost["loop_us"] > 0 and cost["numpy_us"] > 0 for cost in figures["laws"].values())
    assert [way["method"] for way in figures["inverse_dynamics"]] == [
        "lagrange-dalembert",
        "nakamura",
        "ropponen",
        "lagrange-multipliers",
    ]


@pytest.mark.parametrize("name", sorted(load_laws()))
def test_plain_numpy_gives_the_torques_of_the_loop(name):
    controller = law.controller_of(name)
    instants = law.instants_of(controller, 60)
    ours, plain = law.LoopsOwn(controller, instants), law.PlainLoop(controller)
    for instant in instants:
        assert ours.torque(instant) == pytest.approx(plain.torque(instant), abs=1e-12)


def test_plant_tells_our_step_and_numpys_and_mujocos_where_it_is(monkeypatch):
    monkeypatch.setattr(plant_mujoco, "find", lambda: None)
    figures = bench("plant", *TINY)
    assert figures["ours_us"] > 0 < figures["numpy_us"]
    assert figures["mujoco_us"] is None
    assert figures["ours_error_m"] < 1e-12 > figures["numpy_error_m"]


def test_without_mujoco_a_person_is_told_how_to_get_it(monkeypatch):
    monkeypatch.setattr(plant_mujoco, "find", lambda: None)
    monkeypatch.setattr(plant, "trajectory", lambda *_: (np.zeros((plant.SEGMENTS, 2)), 0.0))
    text = CliRunner().invoke(app, ["bench", "plant", *TINY], catch_exceptions=False).stdout
    assert "pip install mujoco" in text


def test_mujoco_goes_where_our_plant_goes():
    reference, _ = plant.trajectory(plant.Ours(plant.STEP_NS))
    places, gap = plant.trajectory(plant_mujoco.MuJoCoPlant(mujoco, Manipulator.thesis(), plant.STEP_NS * 1e-9))
    assert places == pytest.approx(reference, abs=1e-9)
    assert gap < 1e-9


def test_the_trajectory_of_the_plant_benchmark_really_moves():
    places, _ = plant.trajectory(plant.Ours(plant.STEP_NS))
    assert np.max(np.linalg.norm(places - np.array(HOME), axis=1)) > 5e-4


def test_plain_numpy_has_the_models_dynamics():
    model = Manipulator.thesis()
    x, v, tau = np.array((0.101, 0.068)), np.array((0.1, -0.2)), np.array((0.1, 0.0, -0.2))
    expected = model.forward_dynamics(x, v, tau)
    assert PlainManipulator.like(model).acceleration(x, v, tau) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("bus", ["unix:", "pair:"])
def test_wire_tells_ours_the_floor_canopen_and_python_can(bus):
    figures = bench("wire", "--bus", bus, *TINY)
    assert figures["bus"] == bus
    assert all(figures[name] > 0 for name in ("ours_us", "floor_us", "canopen_us", "python_can_us"))
    assert figures["ours_over_floor"] > 0 < figures["canopen_over_ours"]


@pytest.mark.parametrize("bus", ["lockstep:", "unix", "pair:3", "socketcan:", "socketcan:none0"])
def test_wire_over_what_cannot_be_measured_is_refused_in_a_sentence(bus):
    result = CliRunner().invoke(app, ["bench", "wire", "--bus", bus, *TINY])
    assert result.exit_code in {2, 3}
    assert len(result.stderr.splitlines()) == 1
    with pytest.raises((BusUrlError, OSError)):
        wire.measure(bus, turns=1, turn_s=0.001)


def test_lockstep_tells_how_many_times_real_time_at_each_rate_and_with_each_number_of_drives(monkeypatch):
    monkeypatch.setattr(lockstep.measure, "__kwdefaults__", {"rates_hz": (250.0,), "drives": (3, 6)})
    rows = bench("lockstep", "--turns", "1", "--turn", "0.001")["lockstep"]
    assert [(row["rate_hz"], row["drives"], row["machine"]) for row in rows] == [
        (250.0, 3, "rotors"),
        (250.0, 6, "rotors"),
        (250.0, 3, "manipulator"),
    ]
    assert all(row["times_real_time"] > 0 for row in rows)


def test_loop_tells_cycles_overruns_latency_and_lateness_at_each_rate():
    figures = bench("loop", "--rate", "50", "--seconds", "0.2")
    (row,) = figures["rates"]
    assert row["rate_hz"] == 50
    assert row["stopped"] is None
    assert 0 <= row["overruns"] <= row["cycles"]
    assert {"p50", "p99", "p999", "max"} == set(row["latency_us"]) == set(row["lateness_us"])


def test_rates_that_no_can_carries_are_run_all_the_same():
    rig = loop.configuration_at("unix:/tmp/x", 4000.0, 1.0).rig
    assert rig.loop.rate_hz == 4000.0
    assert rig.master.watchdog_periods == 4000


def test_loop_over_a_bus_that_is_none_is_refused_in_a_sentence():
    result = CliRunner().invoke(app, ["bench", "loop", "--bus", "lockstep:", "--rate", "50", "--seconds", "0.1"])
    assert result.exit_code == 2
    assert "other process" in result.stderr
