"""Readings of the torque procedure: what a person types in time or does not, and what the transducer's zero is."""

from contextlib import contextmanager
from itertools import groupby

import numpy as np
import pytest

from torquerig.axes import axis_settings, group_settings
from torquerig.bench import open_bench, transducer_settings
from torquerig.calibration.conductor import Conductor
from torquerig.calibration.errors import NoReading
from torquerig.calibration.torque import Timing, TorqueProcedure
from torquerig.calibration.torque_levels import HeldLevels, Schedule
from torquerig.calibration.torque_sensors import TypedSensor, WireSensor
from torquerig.configuration import load_configuration
from torquerig.driver.master.group import AxisGroup

PERIOD_NS = 4_000_000
PATIENCE = 0.1
QUICK = Schedule(levels=4, ramp=1e6)


def procedure(reader):
    source = HeldLevels(
        lambda conductor: TypedSensor(conductor, reader, patience=PATIENCE), QUICK, settle=0.012, patience=PATIENCE
    )
    return TorqueProcedure((1,), source, QUICK, Timing(0.012, PATIENCE), (20100.0,) * 3)


@contextmanager
def hold(configuration, calibration):
    """Drive 1, enabled, under what the procedure has announced."""
    with (
        open_bench(configuration) as rig,
        AxisGroup(rig.bus, axis_settings(configuration)[:1], group_settings(configuration.rig)) as group,
    ):
        group.enable()
        yield rig, Conductor(group, calibration.plan().bounds, period_ns=PERIOD_NS)


class Reader:
    """A person who types what the levels ask for, as the motor's nominal torque; or, from a level on, nothing."""

    def __init__(self, levels=1000):
        self.levels = levels
        self.asked = []
        self.lines = []

    def ask(self, question):
        self.asked.append(question)
        if question.startswith("Level"):
            self.levels -= 1
            self.lines += [f"{int(question.split()[1]) / 20100:.4f}"] * (self.levels >= 0)
        elif self.levels >= 0:
            self.lines.append("")

    def answer(self):
        return self.lines.pop() if self.lines else None


def test_a_person_can_read_the_display():
    reader = Reader()
    calibration = procedure(reader)
    with hold(load_configuration(), calibration) as (_, conductor):
        measured = calibration.measure(conductor)
    result = calibration.evaluate(measured)
    assert result.facts["axes"][0]["average"] == pytest.approx(20100, abs=20)
    assert len(reader.asked) == 1 + 16


@pytest.mark.parametrize(
    ("levels", "words"),
    [
        (-1, r"axis 1: nobody has set the display to zero within 0\.1 s"),
        (2, r"axis 1, level 6500: there was no reading within 0\.1 s, and the motor gives no torque any more: begin"),
    ],
)
def test_a_reading_that_does_not_come_ends_at_zero_torque(levels, words):
    calibration = procedure(Reader(levels))
    with hold(load_configuration(), calibration) as (rig, conductor):
        with pytest.raises(NoReading, match=words):
            calibration.measure(conductor)
        torques = conductor.notebook.trace().command[:, 0].tolist()
        conductor.group.wait(0.012)
        assert rig.simulation.devices.nodes[1].torque_demand == 0.0
    longest = max((len(list(same)) for level, same in groupby(torques) if level), default=0)
    assert longest <= (PATIENCE + 0.012) / 0.004 + 3


def test_the_transducers_zero_is_the_mean_of_several_conversions():
    """With the noise of one conversion in the zero, intercepts of 10 benches would scatter as that does."""
    noise = 2e-3
    zeros = []
    for seed in range(10):
        configuration = load_configuration(options={"bench.noise": noise, "bench.seed": seed, "bench.friction": 0.0})
        with hold(configuration, procedure(Reader())) as (_, conductor):
            sensor = WireSensor(conductor, transducer_settings(configuration.rig), 30)
            sensor.open()
            sensor.zero(1)
            sensor.begin(0)
            while (shown := sensor.result()) is None:
                conductor.group.wait(0.004)
        zeros.append(shown.torque)
    assert np.std(zeros) < 2 * noise * (2 / 30) ** 0.5  # of two means of 30
