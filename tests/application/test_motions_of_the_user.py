"""Motions that are not the thesis': run in lockstep, and refused before anything moves with what would be right."""

from pathlib import Path

import numpy as np
import pytest

from torquerig import building, load_configuration, run_experiment
from torquerig.configuration import Configuration
from torquerig.control.errors import LimitExceeded
from torquerig.errors import ConfigurationError, MotionError
from torquerig.planning import plan_motion
from torquerig.trajectory_file import read_trajectory

CLOSED = "# there and back\ntime, x, y\n0.5,0.100,0.070\n0.6,0.108,0.074\n\n0.75,0.100,0.070\n"
OPEN = "time,x,y\n0,0.100,0.070\n0.2,0.106,0.073\n"


def configured(**options: object) -> Configuration:
    return load_configuration(options={key.replace("__", "."): value for key, value in options.items()})


def planned(**options: object):
    rig = configured(**options).rig
    return plan_motion(rig, building.controller(rig))


@pytest.fixture
def file(tmp_path):
    def write(text: str, name: str = "my.csv") -> str:
        (tmp_path / name).write_text(text, encoding="utf-8")
        return str(tmp_path / name)

    return write


@pytest.mark.parametrize("motion", ["circle", "corner"])
def test_a_built_in_motion_runs_with_the_gains_of_motion_1(motion):
    outcome = run_experiment(configured(loop__motion=motion))
    summary = outcome.summary.as_json()
    assert (summary["motion"], summary["thesis"]) == (motion, None)
    assert summary["gains"] == {"motion": 1, "kp": 3000.0, "kv": 120.0}
    assert 0.1 < summary["position_rmse_mm"] < 2.0
    assert summary["overruns"] == 0
    assert outcome.log.in_motion.sum() == summary["cycles"] - np.count_nonzero(~outcome.log.in_motion)


def test_a_closed_trajectory_is_repeated_without_a_pause(file):
    path = file(CLOSED)
    outcome = run_experiment(configured(loop__motion=path, loop__repeat=2))
    assert outcome.summary.as_json()["motion"] == "my.csv"
    samples = np.flatnonzero(outcome.log.in_motion)
    assert len(samples) == 2 * 63  # 0.25 s at 4 ms, the remainder too
    assert np.all(np.diff(samples) == 1)
    assert outcome.summary.position_rmse_mm < 2.0


def test_an_open_trajectory_is_led_back_before_it_is_repeated(file):
    table = planned(loop__motion=file(OPEN), loop__repeat=2)
    samples = np.flatnonzero(table.in_motion)
    first, second = np.split(samples, np.flatnonzero(np.diff(samples) > 1) + 1)
    np.testing.assert_array_equal(table.position[first], table.position[second])
    between = slice(first[-1] + 1, second[0])
    assert np.linalg.norm(table.velocity[between], axis=1).max() <= 0.05
    assert np.abs(np.diff(table.position, axis=0)).max() < 0.001


def test_the_approach_ends_where_the_motion_begins(file):
    outcome = run_experiment(configured(loop__motion=file(OPEN)))
    first = np.flatnonzero(outcome.log.in_motion)[0]
    assert outcome.log.desired_position[0] == pytest.approx((0.092, 0.062), abs=1e-6)
    assert outcome.log.desired_position[first] == pytest.approx((0.1, 0.07), abs=1e-12)


@pytest.mark.parametrize(
    ("gains", "motion", "used"), [("auto", 2, 2), (1, 2, 1), (2, "circle", 2), ("auto", "circle", 1)]
)
def test_the_gains_are_those_asked_for(gains, motion, used):
    rig = configured(loop__gains=gains, loop__motion=motion).rig
    assert building.gains_motion(rig) == used
    law = building.controller(rig).law
    assert (law.kp, law.kv) == type(law).gains[used]


def test_changed_gains_go_with_the_motion_they_are_named_for(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text('[loop]\nmotion = "circle"\n\n[laws.computed-torque.motion1]\nkp = 9.0\n', encoding="utf-8")
    assert building.gains(load_configuration(path).rig) == (9.0, 120)


def test_a_configuration_names_a_trajectory_beside_itself(tmp_path, monkeypatch):
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / "my.toml").write_text('[loop]\nmotion = "my.csv"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load_configuration("rig/my.toml").rig.loop.motion == str(Path("rig", "my.csv"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "my.csv is empty: its first line must be time,x,y"),
        ("0,0.1,0.07\n", "my.csv:1: the header is '0,0.1,0.07', it must be time,x,y"),
        ("t,x,y\n", "my.csv:1: the header is 't,x,y', it must be time,x,y"),
        ("time;x;y\n", "my.csv:1: the header is 'time;x;y', it must be time,x,y"),
        ("time,x,y\n", "my.csv: a trajectory needs two points at least, and here is none"),
        ("time,x,y\n0,0.1\n", "my.csv:2: 2 values, there must be 3: time,x,y"),
        ("time,x,y\n# half\n0,0.1,half\n", "my.csv:3: y = 'half' cannot be: it must be a number, as 0.092"),
        ("time,x,y\n0,nan,0.07\n", "my.csv:2: x = 'nan' cannot be: it must be a number"),
        (
            "time,x,y\n0,0.1,0.07\n\n0,0.1,0.07\n",
            "my.csv:4: time = 0 s does not come after the 0 s of line 2: times must increase",
        ),
        ("time,x,y\n0,0.1,0.07\n700,0.1,0.07\n", "my.csv:3: time = 700 s ends a trajectory of 700 s: 600 s at most"),
        (
            "time,x,y\n0,0.1,0.07\n1,0.15,0.07\n",
            "my.csv:3: x = 0.15 m cannot be: limits.workspace_x allows 0.07 to 0.13 m",
        ),
        (
            "time,x,y\n0,100,70\n1,101,71\n",
            "my.csv:2: x = 100 m cannot be: limits.workspace_x allows 0.07 to 0.13 m; positions are in metres",
        ),
        (
            "time,x,y\n0,0.1,0.07\n0.1,0.129,0.07\n0.2,0.1295,0.07\n0.3,0.1,0.07\n",
            "my.csv:3-4, on the curve between these points: x = 0.1307",
        ),
        (
            "time,x,y\n0,0.1,0.07\n0.01,0.12,0.07\n0.02,0.1,0.07\n",
            "my.csv:2-3, on the curve between these points: joint 3 would turn at 39.35 rad/s, limits.joint_speed is"
            " 18.8 rad/s: it fits if it takes 4.95 times as long",
        ),
        (
            "time,x,y\n0,0.1,0.07\n0.04,0.12,0.07\n0.08,0.1,0.07\n",
            "motor 3 would need -1.6",
        ),
    ],
)
def test_a_trajectory_that_cannot_be_run_is_refused_in_one_sentence(file, text, sentence):
    path = file(text)
    with pytest.raises(MotionError) as caught:
        planned(loop__motion=path)
    told = str(caught.value).replace(path, "my.csv")
    assert sentence in told
    assert "\n" not in told


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (f"time,x,y\n0,0.1,{'7' * 140_000}\n", "my.csv:2: this is no line of CSV: field larger than field limit"),
        (f"{'t' * 9999},x,y\n", "my.csv:1: the header is 'ttttttttttt"),
        (
            "time,x,y\n0,0.1,0.07\n1e-320,0.1,0.07\n1,0.1,0.07\n",
            "my.csv:3: time = 9.99988867e-321 s is only 1e-320 s after line 2: 1e-06 s at least",
        ),
        (
            "time,x,y\n0,0.1,0.07\n1,0.075,0.0412\n",
            "my.csv:3: (0.075, 0.0412) m is too near to a singularity: 0.00312 m away, limits.singularity_distance asks"
            " for 0.005 m at least; stay nearer to the middle of the legs",
        ),
        ("# \x0c \x0b \u2028 \x85\ntime,x,y\n0,0.1,half\n", "my.csv:3: y = 'half' cannot be"),
        ("# one\r\n# two\rtime,x,y\r\n0,0.1,half\r\n", "my.csv:4: y = 'half' cannot be"),
    ],
)
def test_a_file_that_nobody_meant_is_refused_with_its_line(file, text, sentence):
    path = file(text)
    with pytest.raises(MotionError) as caught:
        planned(loop__motion=path)
    told = str(caught.value).replace(path, "my.csv")
    assert sentence in told
    assert len(told) < 250


def test_points_a_microsecond_apart_are_still_a_trajectory(file):
    points = "0.5,0.1,0.07\n0.500001,0.1,0.07\n1.5,0.1001,0.07\n"
    assert planned(loop__motion=file("time,x,y\n" + points)).in_motion.sum() == 250


def test_a_circle_near_a_singularity_is_refused_with_its_distance():
    with pytest.raises(
        MotionError, match=r"motion\.circle at 0\.\d+ s: .* limits\.singularity_distance asks for 0\.03"
    ):
        planned(loop__motion="circle", limits__singularity_distance=0.03)


def test_what_is_told_to_fit_does_fit(file):
    text = "time,x,y\n0,0.1,0.07\n{},0.12,0.07\n{},0.1,0.07\n"
    with pytest.raises(MotionError, match=r"takes 1\.32 times as long"):
        planned(loop__motion=file(text.format(0.04, 0.08)))
    assert planned(loop__motion=file(text.format(0.04 * 1.32, 0.08 * 1.32))).in_motion.any()


def test_a_pose_near_a_singularity_is_refused_with_its_conditioning():
    with pytest.raises(
        MotionError, match=r"motion\.circle at 0\.\d+ s: .* conditioning is 0\.\d+, limits\.conditioning"
    ):
        planned(loop__motion="circle", limits__conditioning=0.6)


def test_a_pose_out_of_reach_is_refused_with_its_line(file):
    path = file("time,x,y\n0,0.1,0.07\n1,0.17,0.07\n")
    with pytest.raises(MotionError, match=r"my\.csv:3: .*leg 1, at distance .* cannot get there"):
        planned(loop__motion=path, limits__workspace_x=[0.07, 0.2])


@pytest.mark.parametrize(
    ("motion", "changed", "words"),
    [
        ("circle", {"radius": 0.05}, r"^motion\.circle at 0\.000 s: x = 0\.15 m cannot be: limits\.workspace_x allows"),
        ("circle", {"speed": 1.5, "laps": 9}, r"^motion\.circle at \d\.\d+ s: joint \d would turn .* times as long"),
        ("corner", {"corners": [[0.1, 0.07], [0.1, 0.12]]}, r"^motion\.corner at 0\.\d+ s: y = .*workspace_y allows"),
    ],
)
def test_a_built_in_motion_is_held_against_the_limits_too(motion, changed, words):
    with pytest.raises(MotionError, match=words):
        planned(loop__motion=motion, **{f"motion__{motion}__{key}": value for key, value in changed.items()})


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("loop.motion", "square", 'it must be one of 1, 2, "circle", "corner" or the name of a trajectory file'),
        ("loop.gains", 3, 'it must be one of "auto", 1, 2'),
        (
            "motion.corner.corners",
            [[0.1, 0.07]],
            "it must be a list of at least 2 and of at most 100: each a list of 2",
        ),
        (
            "motion.corner.corners",
            [[0.1, 0.07], [0.1, "y"]],
            'motion.corner.corners.1.1 = "y" cannot be: it must be a n',
        ),
        ("motion.corner.corners", [[0.1, 0.07], [0.1, 0.07]], "[0.1, 0.07] stands twice at number 1; the way back"),
        ("motion.circle.laps", 0, "it must be a whole number at least 1"),
    ],
)
def test_a_setting_that_cannot_be_is_refused(key, value, sentence):
    with pytest.raises(ConfigurationError) as caught:
        configured(**{key.replace(".", "__"): value})
    assert sentence in str(caught.value)


def test_a_file_saved_by_a_spreadsheet_is_read(tmp_path):
    path = tmp_path / "My.CSV"
    path.write_bytes("\ufeffTime, X, Y\r\n0,0.1,0.07\r\n1,0.11,0.07\r\n".encode())
    read = read_trajectory(path)
    assert read.times.tolist() == [0, 1]
    assert [read.place(t) for t in (0.0, 1.0)] == [f"{path}:2", f"{path}:3"]
    assert load_configuration(options={"loop.motion": str(path)}).rig.loop.motion == str(path)


def test_the_limits_still_hold_while_it_runs(file):
    with pytest.raises(LimitExceeded, match="position error"):
        run_experiment(configured(loop__motion=file(OPEN), limits__position_error=1e-4))
