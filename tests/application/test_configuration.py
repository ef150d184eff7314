"""The effective configuration, and what is said of one that cannot be used."""

import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

from torquerig.configuration import load_configuration
from torquerig.errors import ConfigurationError
from torquerig.toml_text import places, write


def complaint_about(tmp_path: Path, text: str) -> str:
    """What is said of a user's file; the file is called my.toml."""
    path = tmp_path / "my.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        load_configuration(path)
    return str(caught.value).replace(f"{tmp_path}/", "")


def test_the_shipped_configuration_is_the_thesis_experiment():
    rig = load_configuration().rig
    assert (rig.loop.law, rig.loop.motion, rig.loop.rate_hz) == ("computed-torque", 1, 250)
    assert (rig.bus.url, rig.simulator.plant) == ("lockstep:", "fitted")
    assert [axis.node_id for axis in rig.axes.legs] == [1, 2, 3]
    assert rig.master.node_id == 127


def test_the_plants_differ_only_in_friction_and_torque_limit_and_fit5_in_motors_and_gears_too():
    plants = load_configuration().rig.plant
    assert {name: (plant.coulomb[0], plant.breakaway[0], plant.torque_limit) for name, plant in plants.items()} == {
        "ideal": (0.0, 0.0, 0.98),
        "identified": (0.0, 0.5, 0.98),
        "fitted": (1.64, 1.64, 0.494),
        "fit5": (2.23, 2.23, 0.320),
    }
    fitted = {"coulomb", "breakaway", "torque_limit"}
    same = [plant.model_dump(exclude=fitted) for name, plant in plants.items() if name != "fit5"]
    assert same[0] == same[1] == same[2]
    five = fitted | {"actuator_inertia", "active_viscous", "gear_compliance"}
    of_five = [plants[name].model_dump(exclude=five) for name in ("fitted", "fit5")]
    assert of_five[0] == of_five[1]
    assert [plant.gear_compliance for plant in plants.values()] == [0.0, 0.0, 0.0, 1.38e-3]


def test_every_shipped_value_says_its_unit_or_source():
    assert [setting.key for setting in load_configuration().settings if not setting.note] == []


def test_a_file_wins_over_the_defaults_and_the_command_line_over_both(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text("[loop]\nrate_hz = 500\nrepeat = 3\n\n[axes.2]\nsign = -1\n", encoding="utf-8")
    configuration = load_configuration(path, {"loop.repeat": 4}, origin="command line")
    assert configuration.rig.loop.rate_hz == 500
    assert configuration.rig.loop.repeat == 4
    assert [axis.sign for axis in configuration.rig.axes.legs] == [1, -1, 1]
    sources = {setting.key: setting.source for setting in configuration.settings}
    assert sources["loop.rate_hz"] == f"{path}:2"
    assert sources["loop.repeat"] == "command line"
    assert sources["axes.2.sign"] == f"{path}:6"
    assert sources["loop.law"] == "default"


def test_gains_of_a_law_can_be_changed_one_by_one(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text("[laws.coupled-pd.motion2]\nkv = 1100.0\n", encoding="utf-8")
    gains = load_configuration(path).rig.laws["coupled-pd"].of(2)
    assert (gains.kp, gains.kv) == (None, 1100.0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[loop]\nrate = 500\n", "my.toml:2: loop.rate is not a setting; did you mean loop.rate_hz?"),
        ("[lop]\nrate_hz = 500\n", "my.toml:1: lop is not a table; did you mean loop?"),
        (
            "[loop]\nrate_hz = 0\n",
            "my.toml:2: loop.rate_hz = 0 cannot be: it must be a number at least 1 and at most 4000",
        ),
        ("[loop]\nmotion = 3\n", "my.toml:2: loop.motion = 3 cannot be: it must be one of 1, 2"),
        (
            '[loop]\ncommand_after = "soon"\n',
            'my.toml:2: loop.command_after = "soon" cannot be: it must be one of "auto", "computed"'
            " or a number at least 0 and at most 1000",
        ),
        (
            "[loop]\ncommand_after = 4.0\n",
            "my.toml:2: loop.command_after = 4 ms cannot be: at loop.rate_hz = 250 it must be at least 0 and below the"
            " period of 4 ms",
        ),
        ('[loop]\nlaw = "compued-torque"\n', "did you mean computed-torque?"),
        ('[simulator]\nplant = "fited"\n', "my.toml:2: simulator.plant = 'fited' is not a plant; did you mean fitted?"),
        ('[laws."coupled pd".motion1]\nkp = 1.0\n', "did you mean coupled-pd?"),
        ("[laws.coupled-pd.motion3]\nkp = 1.0\n", "laws.coupled-pd.motion3 is not a setting"),
        (
            "[plant.fitted]\ncoulomb = [1.0, -1.0, 1.0]\n",
            "my.toml:2: plant.fitted.coulomb.1 = -1.0 cannot be: it must be a number at least 0",
        ),
        ("[plant.mine]\ncoulomb = [0.0, 0.0, 0.0]\n", "my.toml:1: plant.mine.actuator_inertia is missing"),
        ("[axes.2]\nnode_id = 3\n", "axes.3.node_id = 3 cannot be: axes.2.node_id has this node-id already"),
        ("[motion.1]\ntj = 0.5\n", "my.toml:1: motion.1 cannot be driven: a ramp of 0.5 s is longer than v/a = 0.03 s"),
        ("[limits]\nworkspace_x = [0.1, 0.2]\n", "model.home = 0.092 must lie inside it"),
        ("loop = 3\n", "my.toml:1: loop = 3 cannot be: it must be a table"),
        ("[loop]\nrepeat = 1.5\n", "my.toml:2: loop.repeat = 1.5 cannot be: it must be a whole number"),
        ("[limits]\njoint_speed = inf\n", "my.toml:2: limits.joint_speed = inf cannot be"),
        ("[loop]\nrate_hz =\n", "the configuration my.toml is not TOML"),
    ],
)
def test_a_configuration_that_cannot_be_used_is_refused_in_one_sentence(tmp_path, text, sentence):
    told = complaint_about(tmp_path, text)
    assert sentence in told
    assert "\n" not in told


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match=r"cannot read the configuration .*no\.toml: No such file"):
        load_configuration(tmp_path / "no.toml")


def test_an_option_out_of_range_names_its_key_and_who_set_it():
    with pytest.raises(ConfigurationError, match=r"^options: loop\.rate_hz = -1\.0 cannot be: .* at least 1"):
        load_configuration(options={"loop.rate_hz": -1.0})


def test_places_are_found_past_comments_quotes_and_arrays():
    text = 'a = 1 # one\n["x y".z] # table\nb = "# no" # yes\nc = [\n  [1, 2],\n]\nd.e = 3\n'
    assert tomllib.loads(text)["x y"]["z"]["d"] == {"e": 3}
    assert places(text) == {
        "a": (1, "one"),
        "x y.z": (2, "table"),
        "x y.z.b": (3, "yes"),
        "x y.z.c": (4, ""),
        "x y.z.d.e": (7, ""),
    }


@pytest.mark.parametrize("value", [True, 3, 1e-4, 6.214e-4, 'a"b\\c', [[0.0, 0.062], [1, 2]], []])
def test_what_is_written_reads_back_as_itself(value):
    assert tomllib.loads(f"x = {write(value)}")["x"] == value


def test_no_shipped_key_stands_twice_or_is_missing_from_the_places():
    shipped = files("torquerig").joinpath("rig.toml").read_text(encoding="utf-8")
    assert {setting.key for setting in load_configuration().settings} <= set(places(shipped))
