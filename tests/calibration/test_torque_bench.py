"""The torque procedure wholly over the wire, on simulated benches whose truth varies."""

import json
from contextlib import contextmanager

import numpy as np
import pytest

from torquerig.assembly import open_rig
from torquerig.axes import axis_settings, group_settings
from torquerig.bench import build_bench, open_bench, transducer_settings
from torquerig.calibrating.offer import Request
from torquerig.calibrating.torque import OFFER, make, truth
from torquerig.calibration.conductor import Conductor
from torquerig.calibration.procedure import Grade
from torquerig.calibration.torque import PER_DIRECTION, Timing, TorqueProcedure
from torquerig.calibration.torque_levels import HeldLevels, Schedule
from torquerig.calibration.torque_sensors import WireSensor
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.control.errors import LimitExceeded
from torquerig.device_sim.transducer import SensorFault
from torquerig.driver.errors import DriveError
from torquerig.driver.master.group import AxisGroup
from torquerig.errors import ConfigurationError

PERIOD_NS = 4_000_000
SAMPLES = 6
PATIENCE = 0.1
QUICK = Schedule(levels=4, ramp=1e6)
RIGS = 20


def procedure(configuration, schedule=QUICK, maker=None, **parameters):
    settings = transducer_settings(configuration.rig)
    maker = maker or (lambda conductor: WireSensor(conductor, settings, SAMPLES))
    source = HeldLevels(maker, schedule, settle=0.012, patience=PATIENCE)
    return TorqueProcedure((1,), source, schedule, Timing(0.012, 0.1), (20100.0,) * 3, **parameters)


@contextmanager
def hold(configuration, calibration, open_=open_bench):
    """Drive 1, enabled, under what the procedure has announced."""
    with (
        open_(configuration) as rig,
        AxisGroup(rig.bus, axis_settings(configuration)[:1], group_settings(configuration.rig)) as group,
    ):
        group.enable()
        yield rig, Conductor(group, calibration.plan().bounds, period_ns=PERIOD_NS)


def calibrate(options=None, **parameters):
    configuration = load_configuration(options=options)
    calibration = procedure(configuration, **parameters)
    with hold(configuration, calibration) as (_, conductor):
        measured = calibration.measure(conductor)
    return calibration.evaluate(measured)


def varied(seed):
    """A bench whose gains, friction, zero and noise are its own."""
    rng = np.random.default_rng(seed)
    return {
        "drive.gain_positive": 20670.0 * rng.uniform(0.95, 1.05),
        "drive.gain_negative": 19528.0 * rng.uniform(0.95, 1.05),
        "bench.friction": rng.uniform(0.005, 0.025),
        "bench.offset": rng.uniform(-0.01, 0.01),
        "bench.noise": rng.uniform(2e-4, 8e-4),
        "bench.seed": seed,
    }


@pytest.fixture(scope="module")
def rigs():
    return [(options, calibrate(options).facts["axes"][0]) for options in map(varied, range(RIGS))]


def test_slopes_of_20_rigs_are_recovered_within_half_a_percent(rigs):
    for options, axis in rigs:
        for name in ("positive", "negative"):
            assert axis[name]["counts_per_nm"] == pytest.approx(options[f"drive.gain_{name}"], rel=5e-3)


def test_intervals_of_20_rigs_cover_the_truth(rigs):
    covered = [
        axis[name]["low"] <= options[f"drive.gain_{name}"] <= axis[name]["high"]
        for options, axis in rigs
        for name in ("positive", "negative")
    ]
    assert sum(covered) >= 34  # of 40: 38 are expected, and 34 are three standard deviations fewer


def test_friction_of_20_rigs_is_recovered(rigs):
    for options, axis in rigs:
        assert axis["positive"]["friction_nm"] == pytest.approx(options["bench.friction"], abs=5e-4)


def test_the_shipped_bench_gives_the_thesis_average():
    result = calibrate({"bench.noise": 1e-4})
    assert result.verdict.grade is Grade.OK
    assert result.facts["axes"][0]["average"] == pytest.approx(20100, abs=50)
    assert result.settings["axes.1.counts_per_nm_positive"] == result.settings["axes.1.counts_per_nm_negative"]


def test_per_direction_each_slope_is_set_by_itself():
    result = calibrate({"bench.noise": 1e-4}, mode=PER_DIRECTION)
    assert result.settings["axes.1.counts_per_nm_positive"] == pytest.approx(20670, rel=2e-3)
    assert result.settings["axes.1.counts_per_nm_negative"] == pytest.approx(19528, rel=2e-3)


@pytest.mark.parametrize(
    ("options", "grade", "reason"),
    [
        ({"bench.fault": "dead"}, Grade.FAILED, "the transducer is dead"),
        ({"bench.fault": "reversed"}, Grade.FAILED, "wrong sign"),
        ({"simulator.installation.torque_sign": [-1, 1, 1]}, Grade.FAILED, "wrong sign"),
        ({"bench.range": 0.36}, Grade.SUSPICIOUS, "saturated at levels -8000, 8000: the transducer says"),
    ],
)
def test_each_fault_is_named(options, grade, reason):
    result = calibrate(options)
    assert result.verdict.grade is grade
    assert reason in " ".join(result.verdict.reasons)
    assert result.verdict.advice


def test_a_silently_clipping_amplifier_leaves_too_few_levels():
    result = calibrate({"bench.fault": "saturated"})
    assert result.verdict.grade is Grade.FAILED
    assert "too few levels" in " ".join(result.verdict.reasons)
    assert "the readings have stopped growing" in " ".join(result.verdict.reasons)
    assert result.settings == {}


def test_a_level_beyond_the_drives_limit_is_named():
    result = calibrate(schedule=Schedule(3500, 11000, 4, ramp=1e6))
    assert "saturated at levels -11000, 11000: the drive says that it gives less" in " ".join(result.verdict.reasons)


def test_a_disconnected_bridge_ends_the_procedure():
    with pytest.raises(DriveError, match=r"says that its value is not valid .*: its bridge is disconnected or broken"):
        calibrate({"bench.fault": "disconnected"})


class BreakingSensor(WireSensor):
    """A transducer whose bridge breaks when the third level begins."""

    def __init__(self, conductor, settings, break_it):
        super().__init__(conductor, settings, SAMPLES)
        self.levels = 0
        self.break_it = break_it

    def begin(self, level):
        super().begin(level)
        self.levels += 1
        if self.levels == 3:
            self.break_it(SensorFault.DISCONNECTED)


def test_a_bridge_that_breaks_in_the_middle_ends_it_at_zero_torque_with_its_emergency_told():
    configuration = load_configuration()
    nodes = {}

    def maker(conductor):
        def break_it(fault):
            nodes[10].suffer(fault, conductor.now_ns())

        return BreakingSensor(conductor, transducer_settings(configuration.rig), break_it)

    def run():
        calibration = procedure(configuration, maker=maker)
        with hold(configuration, calibration) as (rig, conductor):
            nodes.update(rig.simulation.devices.nodes)
            calibration.measure(conductor)

    with pytest.raises(
        DriveError, match=r"its value is not valid \(6150 is 0x03\), and it tells device hardware \(0x5000\)"
    ):
        run()
    assert (nodes[1].torque_demand, nodes[1].store.get(0x6041) & 0x6F) == (0.0, 0x40)  # switch on disabled


def test_the_command_fits_a_file_and_prints_one_object(tmp_path, capsys):
    lines = [f"{level},{level / gain:.6f}" for gain in (20670, 19528) for level in (3500, 5000, 6500, 8000)]
    lines[4:] = ["-" + line.replace(",", ",-") for line in lines[4:]]
    levels = tmp_path / "levels.csv"
    levels.write_text("\n".join(["level,reading", *lines]))
    options = ["--axis", "2", "--sensor", "csv", "--readings", str(levels), "--out", str(tmp_path), "--json"]
    assert main(["calibrate", "torque", *options]) == 0
    told = json.loads(capsys.readouterr().out)
    (axis,) = told["axes"]
    assert axis["axis"] == 2
    assert axis["positive"]["counts_per_nm"] == pytest.approx(20670, abs=1)
    assert axis["negative"]["low"] <= 19528 <= axis["negative"]["high"]
    assert axis["average"] == pytest.approx(20099, abs=1)
    assert told["truth"] == {}  # of whatever bench the file is of
    assert (tmp_path / "calibration.toml").exists()


def test_a_rotor_that_is_not_locked_stops_at_once_and_gives_no_torque_then():
    configuration = load_configuration()
    calibration = procedure(configuration)
    with (
        pytest.raises(LimitExceeded, match=r"agreed (speed|travel)"),
        hold(configuration, calibration, lambda c: open_rig(c, build=lambda s, t: build_bench(s, t, axes=(2,)))) as (
            rig,
            conductor,
        ),
    ):
        calibration.measure(conductor)
    drive = rig.simulation.devices.nodes[1]
    assert (drive.torque_demand, drive.store.get(0x6041) & 0x6F) == (0.0, 0x40)  # switch on disabled


def test_the_offer_knows_the_truth_of_the_simulator():
    told = truth(load_configuration(), Request(2))
    assert told == {
        "axes": [{"axis": 2, "positive": 20670.0, "negative": 19528.0, "average": 20099.0, "friction_nm": 0.02}]
    }


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"sensor": "ear"}, "--sensor ear is not known"),
        ({"mode": "best"}, "--mode best is not known"),
        ({"levels": 1}, "--low, --high, --levels"),
        ({"settle": -1.0}, "--settle -1 cannot be"),
        ({"average": 0.001}, "--average 0.001 cannot be"),
        ({"patience": 0.0}, "--patience 0 cannot be"),
        ({"sensor": "csv"}, "--sensor csv needs --readings FILE"),
    ],
)
def test_what_cannot_be_asked_for_is_told(changed, complaint):
    options = {option.name: option.default for option in OFFER.options} | changed
    with pytest.raises(ConfigurationError, match=complaint):
        make(load_configuration(), Request(1, options))


def test_on_a_real_bench_the_axis_has_to_be_named():
    options = {option.name: option.default for option in OFFER.options}
    with pytest.raises(ConfigurationError, match="needs --axis N here"):
        make(load_configuration(options={"bus.url": "socketcan:vcan0"}), Request(None, options))
