"""The driver's transducer on the simulated bench, beside a drive."""

from contextlib import contextmanager
from itertools import pairwise

import pytest

from torquerig.axes import axis_settings, group_settings
from torquerig.bench import build_bench, open_bench, transducer_settings
from torquerig.configuration import load_configuration
from torquerig.driver.errors import ConfigurationMismatch, EdsError, NoAnswer
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.transducer import Transducer, TransducerSettings
from torquerig.driver.wire.measuring import TRANSDUCER_EDS, AiStatus, split_unit

NODE_ID = 10


@contextmanager
def bench(options=None):
    """Drive 1 in a group, and the transducer's settings."""
    configuration = load_configuration(options=options)
    with (
        open_bench(configuration) as rig,
        AxisGroup(rig.bus, axis_settings(configuration)[:1], group_settings(configuration.rig)) as group,
    ):
        yield rig, group, transducer_settings(configuration.rig)


def cycles(group, count, level=0):
    due_ns = group.now_ns() + 2_000_000
    for _ in range(count):
        sample = group.sample_raw(due_ns)
        group.command_raw([level], group.now_ns())
        due_ns = max(due_ns + 4_000_000, sample.at_ns + 2_000_000)


def test_it_is_configured_zeroed_and_read_after_every_sync():
    with bench({"bench.noise": 0.0, "bench.friction": 0.0}) as (_, group, settings):
        transducer = Transducer(group.session, settings)
        transducer.open()
        assert transducer.latest().torque == pytest.approx(0.004)  # the shipped offset
        transducer.zero()
        group.enable()
        cycles(group, 5, 4000)
        transducer.take()
        cycles(group, 10, 4000)
        readings = transducer.take()
        assert 9 <= len(readings) <= 11
        for reading in readings:
            assert reading.torque == pytest.approx(4000 / 20670, abs=1e-5)
        assert {reading.status for reading in readings} == {AiStatus(0)}
        for before, after in pairwise(readings[2:]):  # of one run of cycles
            assert after.at_ns - before.at_ns == pytest.approx(4_000_000, abs=500_000)
        transducer.close()


def test_a_reversed_mounting_is_a_sign():
    with bench({"bench.noise": 0.0, "bench.sign": -1}) as (_, group, settings):
        transducer = Transducer(group.session, settings)
        transducer.open()
        assert transducer.latest().torque == pytest.approx(-0.004)


def test_a_node_that_is_not_there_is_told():
    with (
        bench() as (_, group, _settings),
        pytest.raises(NoAnswer, match="no answer from transducer 11: it is not on the bus"),
    ):
        Transducer(group.session, TransducerSettings(11)).open()


def test_a_drive_is_no_transducer():
    with (
        bench() as (_, group, _settings),
        pytest.raises(ConfigurationMismatch, match=r"node 2 is no measuring device.*profile CiA 402 and not CiA 404"),
    ):
        Transducer(group.session, TransducerSettings(2)).open()


@pytest.mark.parametrize("node_id", [1, 127])
def test_a_node_id_that_is_taken_is_refused(node_id):
    with bench() as (_, group, _settings), pytest.raises(ValueError, match="is another's"):
        Transducer(group.session, TransducerSettings(node_id))


@pytest.mark.parametrize(
    ("right", "wrong", "complaint"),
    [
        ("0x00560000", "0x00220000", "transducer 10 measures no torque: its unit \\(6131\\) is 0x00220000"),
        ("DefaultValue=0x00000002", "DefaultValue=0x00000003", "transducer 10 holds 3 in 1018:2"),
    ],
)
def test_another_device_than_configured_is_told(tmp_path, right, wrong, complaint):
    text = TRANSDUCER_EDS.read_text("ascii")
    assert right in text
    eds = tmp_path / "other.eds"
    eds.write_text(text.replace(right, wrong, 1), "ascii")
    with bench({"bench.eds": str(eds)}) as (_, group, _settings), pytest.raises(ConfigurationMismatch, match=complaint):
        Transducer(group.session, TransducerSettings(NODE_ID)).open()


def test_units_with_a_prefix_scale_the_value(tmp_path):
    eds = tmp_path / "milli.eds"
    text = TRANSDUCER_EDS.read_text("ascii")
    eds.write_text(text.replace("0x00560000", "0xFD560000", 1).replace("DefaultValue=5\n", "DefaultValue=2\n"), "ascii")
    with bench({"bench.eds": str(eds), "bench.noise": 0.0}) as (_, group, settings):
        transducer = Transducer(group.session, settings)
        transducer.open()
        # the simulated one counts hundredths of N·m now, its EDS calls them hundredths of mN·m
        assert transducer.latest().torque == pytest.approx(0.0)


def test_unit_codes_have_signed_prefixes():
    assert split_unit(0xFA010100) == (-6, 0x01, 0x01)  # Baumer StrainLink manual: micrometres a metre
    assert split_unit(0xFD560000).is_torque
    assert not split_unit(0x00230000).is_torque


def test_an_eds_without_a_process_value_is_told(tmp_path):
    eds = tmp_path / "none.eds"
    eds.write_text(TRANSDUCER_EDS.read_text("ascii").replace("9130", "9131"), "ascii")
    with bench() as (_, group, _settings), pytest.raises(EdsError, match="holds no process value"):
        Transducer(group.session, TransducerSettings(NODE_ID, eds))


def test_silence_is_noticed_and_a_restart_named():
    with bench() as (rig, group, settings):
        transducer = Transducer(group.session, settings)
        transducer.open()
        group.wait(0.05)
        rig.simulation.devices.nodes[NODE_ID].power_cycle(group.now_ns())
        group.wait(0.2)
        with pytest.raises(NoAnswer, match=r"transducer 10 has sent no value for 0.1 s: it"):
            transducer.take()


def test_what_cannot_be_zeroed_is_told():
    with bench({"bench.fault": "disconnected"}) as (_, group, settings):
        transducer = Transducer(group.session, settings)
        transducer.open()
        assert transducer.latest().status == AiStatus.NOT_VALID | AiStatus.POSITIVE_OVERLOAD
        with pytest.raises(ConfigurationMismatch, match=r"transducer 10 cannot be zeroed \(6125\)"):
            transducer.zero()


def test_the_bench_locks_the_axes_asked_for():
    simulation = build_bench(load_configuration().rig, axes=(2,))
    assert simulation.machine.locked == (1,)
    assert sorted(simulation.devices.nodes) == [1, 2, 3, NODE_ID]
