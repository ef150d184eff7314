"""Direction, home, stiction and latency in lockstep: what they recover of the simulator's truth, and what they name."""

from functools import cache

import numpy as np
import pytest

from torquerig.calibrating.catalogue import offer
from torquerig.calibrating.conducting import perform
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Task
from torquerig.calibration.procedure import Grade, Unwatched
from torquerig.cli import main
from torquerig.configuration import load_configuration

WIRED = "simulator.installation."
UNLIKE = {"plant.fitted.coulomb": [3.85, 2.96, 0.2], "plant.fitted.breakaway": [3.85, 2.96, 0.2]}


def carry_out(name, keys, seed=0, **options):
    """A procedure's result and the truth of it."""
    made = offer(name)
    configuration = load_configuration(options=keys)
    request = Request(None, {each.name: each.default for each in made.options} | options)
    result, _ = perform(Task.prepare(name, made, configuration, request), Unwatched(), seed=seed)
    return result, made.truth(configuration, request)


@cache
def known_gains():
    """The truth of the drives' scale, as the torque procedure would have found it."""
    found = {"axes.%d.counts_per_nm_positive": 20670.0, "axes.%d.counts_per_nm_negative": 19528.0}
    return {key % leg: value for key, value in found.items() for leg in (1, 2, 3)}


@pytest.mark.parametrize(
    ("plant", "keys", "words"),
    [
        ("fitted", {}, []),
        ("identified", {}, []),
        ("fitted", {"encoder_sign": [1, -1, 1]}, ["axis 2: wrong encoder sign"]),
        ("identified", {"torque_sign": [-1, 1, 1]}, ["axis 1: wrong torque sign"]),
        ("ideal", {"encoders": [3, 2, 1]}, ["the encoders of axes 1 and 3 are swapped"]),
        ("unlike", {"gear_factor": [1.0, 1.06, 1.0]}, ["axis 2: wrong gear or encoder counts, it shows 1.06"]),
        (
            "fitted",
            {"motors": [2, 1, 3], "encoders": [2, 1, 3], "encoder_sign": [1, 1, -1]},
            ["axes 1 and 2 are swapped", "axis 3: wrong encoder sign"],
        ),
        (
            "fitted",
            {"coupling": [0.08, 1e3, 1e3], "gear_factor": [1.0, 1.2, 1.0]},
            [
                "axis 2: wrong gear or encoder counts, it shows 1.2",
                "axis 1: its motor turns and the joint does not",
            ],
        ),
        (
            "unlike",
            {"torque_sign": [1, 1, -1], "encoder_counts": [8000, 4000, 8000]},
            ["axis 3: wrong torque sign", "axis 2: wrong gear or encoder counts, it shows 0.5"],
        ),
    ],
)
def test_direction_names_the_faults_that_the_rig_has(plant, keys, words):
    faults = {WIRED + key: value for key, value in keys.items()}
    machine = UNLIKE if plant == "unlike" else {"simulator.plant": plant}
    result, _ = carry_out("direction", machine | faults, rate=0.4)
    if not words:
        assert result.verdict.grade is Grade.OK
        assert result.settings == {"axes.1.sign": 1, "axes.2.sign": 1, "axes.3.sign": 1}
        return
    assert result.verdict.grade is Grade.FAILED
    assert len(result.facts["faults"]) == len(words)
    for told, begin in zip(result.verdict.reasons, words, strict=False):
        assert told.startswith(begin)
    assert result.verdict.advice
    assert not result.settings


def test_direction_turns_an_axis_round_that_counts_the_other_way():
    result, _ = carry_out(
        "direction", {WIRED + "torque_sign": [1, 1, -1], WIRED + "encoder_sign": [1, 1, -1]}, rate=0.4
    )
    assert result.verdict.grade is Grade.OK
    assert result.settings == {"axes.1.sign": 1, "axes.2.sign": 1, "axes.3.sign": -1}


def test_direction_says_that_nothing_moves_in_the_fixture():
    result, _ = carry_out(
        "direction", {"plant.fitted.coulomb": [20.0] * 3, "plant.fitted.breakaway": [20.0] * 3}, rate=5.0
    )
    assert result.verdict.grade is Grade.FAILED
    assert "nothing moved up to 0.3 N·m" in result.verdict.reasons[0]


def test_home_is_ok_on_a_right_rig():
    result, _ = carry_out("home", {}, reach=1.0)
    assert result.verdict.grade is Grade.OK
    assert result.facts["residual_um"] < 5.0
    assert result.facts["moved_mm"] > 1.0


@pytest.mark.parametrize(("zero", "grade"), [(1e-3, Grade.SUSPICIOUS), (1.745e-2, Grade.FAILED)])
def test_home_sees_a_wrong_zero_by_the_redundant_leg(zero, grade):
    result, _ = carry_out("home", {"axes.2.encoder_zero": zero}, reach=1.0)
    assert result.verdict.grade is grade


@pytest.mark.parametrize(
    "keys",
    [{"axes.1.sign": -1}, {WIRED + "torque_sign": [-1, 1, 1], WIRED + "encoder_sign": [-1, 1, 1]}],
)
@pytest.mark.parametrize("reach", [1.0, 4.0])
def test_home_is_not_ok_when_a_reversed_joint_keeps_the_round_from_being_made(keys, reach):
    result, _ = carry_out("home", keys, reach=reach)
    assert result.verdict.grade is Grade.FAILED
    assert "the round was not made: a corner was missed" in result.verdict.reasons[0]
    assert "torquerig calibrate direction" in result.verdict.advice[0]


def test_home_is_ok_after_the_smallest_round():
    result, _ = carry_out("home", {}, reach=0.5)
    assert result.verdict.grade is Grade.OK


def test_home_sees_a_wrong_gear_by_the_redundant_leg():
    result, _ = carry_out("home", {WIRED + "gear_factor": [1.0, 1.1, 1.0]}, reach=1.0)
    assert result.verdict.grade is not Grade.OK


@pytest.mark.parametrize("seed", range(3))
def test_latency_recovers_delay_and_lag(seed):
    rng = np.random.default_rng(seed)
    reaction, sample, lag = rng.uniform(3e-5, 2e-4), rng.uniform(1e-5, 1e-4), rng.uniform(6e-5, 2e-4)
    keys = {"drive.reaction": reaction, "drive.sample": sample, "plant.fitted.current_lag": lag}
    result, truth = carry_out("latency", keys, seed, steps=80)
    assert result.verdict.grade is Grade.OK
    found = {"latency.sample": sample, "latency.reaction": reaction, "latency.current_lag": lag}
    assert result.settings == pytest.approx(found, abs=4e-6)
    rows = {each.name: each for each in result.estimates if each.name in found}
    assert all(rows[key].low <= rows[key].value <= rows[key].high for key in found)
    for axis in result.facts["axes"]:
        delay = truth["reaction_us"] + 95 * axis["axis"]
        margin = 3.0  # the wire's arbitration moves single steps by a few microseconds
        assert axis["delay_us"]["low"] - margin <= delay <= axis["delay_us"]["high"] + margin
        assert axis["lag_us"]["low"] - margin <= truth["current_lag_us"] <= axis["lag_us"]["high"] + margin


@pytest.mark.parametrize("nodes", [(3, 2, 1), (7, 2, 5)])
def test_latency_knows_that_the_lowest_node_hears_its_command_first(nodes):
    keys = {f"axes.{axis}.node_id": node for axis, node in enumerate(nodes, start=1)}
    result, truth = carry_out("latency", keys, steps=80)
    assert result.verdict.grade is Grade.OK
    for axis in result.facts["axes"]:
        assert axis["reaction_us"] == pytest.approx(truth["reaction_us"], abs=5.0)


def test_latency_knows_drives_that_act_at_the_next_sync():
    result, _ = carry_out("latency", {"loop.rpdo_type": 1}, steps=40)
    assert result.verdict.grade is Grade.FAILED
    assert "the delay is one period" in result.verdict.reasons[0]


def test_latency_refuses_a_group_rpdo(tmp_path, capsys):
    config = tmp_path / "my.toml"
    config.write_text("[loop]\ngroup_rpdo = true\n")
    assert main(["calibrate", "latency", "--dry-run", "--config", str(config)]) == 2
    printed = capsys.readouterr().err
    assert "set loop.group_rpdo = false" in printed
    assert printed.count("\n") == 1


@pytest.mark.parametrize("seed", range(2))
def test_stiction_covers_the_truth_where_the_torque_scale_is_known(seed):
    rng = np.random.default_rng(seed)
    friction = rng.uniform(1.0, 1.8, 3).tolist()
    keys = known_gains() | {"plant.fitted.coulomb": friction, "plant.fitted.breakaway": friction}
    result, truth = carry_out("stiction", keys, seed, repeats=2, rate=0.03)
    assert result.verdict.grade is Grade.OK
    for axis, true in zip(result.facts["axes"], truth["motor_nm"], strict=True):
        mean = (axis["positive"]["motor_nm"] + axis["negative"]["motor_nm"]) / 2
        assert mean == pytest.approx(true, rel=0.02)
        assert axis["positive"]["low"] <= true <= axis["positive"]["high"]
        assert axis["negative"]["low"] <= true <= axis["negative"]["high"]


def test_stiction_finds_the_breakaway_of_a_machine_that_then_moves_freely():
    result, truth = carry_out("stiction", known_gains() | {"simulator.plant": "identified"}, repeats=2, rate=0.03)
    values = [estimate.value for estimate in result.estimates]
    assert np.mean(values) == pytest.approx(np.mean(truth["motor_nm"]), rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["stiction", "--most", "9"], "--most 9 N·m cannot be: above 0 and at most limits.torque = 0.98"),
        (["stiction", "--repeats", "1"], "--repeats 1 cannot be"),
        (["latency", "--steps", "2"], "--steps 2 cannot be: 40 to 10000"),
        (["direction", "--axis", "2"], "leave --axis out"),
        (["home", "--reach", "50"], "--reach 50 mm cannot be"),
        (["identify", "--dry-run", "--picture", "/nope/x.png"], "cannot be written: there is no folder /nope"),
        (["identify", "--dry-run", "--picture", "x.doc"], "--picture x.doc cannot be: its name must end in .png"),
    ],
)
def test_a_bad_option_is_one_sentence(capsys, arguments, sentence):
    assert main(["calibrate", *arguments]) == 2
    printed = capsys.readouterr()
    assert sentence in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""
