"""Objects are read beside the cycle at a pace that leaves heartbeats their room, however full the bus is."""

import numpy as np
import pytest

from torquerig.assembly import open_rig
from torquerig.axes import axis_settings, group_settings
from torquerig.configuration import load_configuration
from torquerig.driver.errors import EnablingRefused
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.wire.nmt import NmtCommand, encode_command

HEARTBEATS = range(0x701, 0x780)
FULL = [
    {"loop.rate_hz": 1000.0},
    {"loop.rate_hz": 250.0, "bus.bitrate": 250_000},
    {"loop.rate_hz": 1e6 / 750, "loop.group_rpdo": True},
]


def entered(configuration, rig):
    return AxisGroup(rig.bus, axis_settings(configuration), group_settings(configuration.rig))


@pytest.mark.parametrize("keys", FULL)
def test_no_heartbeat_is_kept_from_the_bus_by_objects_that_are_read(keys):
    configuration = load_configuration(options=keys)
    heard: dict[int, list[int]] = {}

    def tap(at_ns, frame):
        if frame.can_id in HEARTBEATS:
            heard.setdefault(frame.can_id, []).append(at_ns)

    with open_rig(configuration, tap) as rig, entered(configuration, rig) as group:
        begin_ns = group.now_ns()
        session = group.session
        jobs = {axis.node_id: many_reads(axis, 40) for axis in group.axes}
        session.service.run(jobs)
        group.wait(0.1)
        assert not group.emergencies
        assert set(heard) == {0x701, 0x702, 0x703, 0x77F}
        for times in heard.values():
            late = np.diff([at for at in times if at > begin_ns - 50_000_000])
            assert late.max() < 70_000_000  # produced every 50 or 40 ms, missed after 100


def many_reads(axis, count):
    for _ in range(count):
        yield from axis.objects.read_number(0x6041)


def test_at_1_khz_drives_are_homed_and_enabled():
    configuration = load_configuration(options={"loop.rate_hz": 1000.0})
    with open_rig(configuration) as rig, entered(configuration, rig) as group:
        for axis in group.axes:
            for subindex in (1, 2, 3, 4):
                group.read(axis.node_id, 0x1018, subindex)
        assert group.home()
        assert group.enable() == []


def deafened(rig, group):
    """Keep the master's heartbeat back for longer than drives wait, and only then enable them."""
    session = group.session
    (producer,) = session._producers
    session.pump.remove_timed(producer)
    group.wait(0.2)
    session.pump.add_timed(producer)
    begin_ns = rig.bus.now_ns()
    try:
        group.enable()
    finally:
        assert rig.bus.now_ns() - begin_ns < 1_000_000_000  # the usual patience is 2 s


def test_a_drive_that_loses_heartbeats_before_it_is_enabled_is_told_at_once():
    configuration = load_configuration()
    words = r"drives 1, 2 and 3 left NMT operational after .*heartbeat or life guarding lost \(0x8130\)"
    with (
        open_rig(configuration) as rig,
        entered(configuration, rig) as group,
        pytest.raises(EnablingRefused, match=words),
    ):
        deafened(rig, group)


@pytest.mark.parametrize("command", [NmtCommand.PRE_OPERATIONAL, NmtCommand.STOP, NmtCommand.RESET_NODE])
def test_a_drive_that_somebody_takes_out_of_operational_is_named(command):
    configuration = load_configuration()
    with open_rig(configuration) as rig:
        group = entered(configuration, rig)
        with pytest.raises(EnablingRefused, match="drive 2 left NMT operational after the start"), group:
            commanded(rig, group, command)


def commanded(rig, group, command):
    group.wait(0.1)
    rig.bus.send(encode_command(command, 2))
    group.wait(0.1)
    group.session.walk(group.axes, {})


@pytest.mark.parametrize("bitrate", [1_000_000, 250_000])
def test_heartbeats_find_room_while_drives_are_configured(bitrate):
    heard: dict[int, list[int]] = {}

    def tap(at_ns, frame):
        if frame.can_id in HEARTBEATS:
            heard.setdefault(frame.can_id, []).append(at_ns)

    configuration = load_configuration(options={"bus.bitrate": bitrate})
    with open_rig(configuration, tap) as rig, entered(configuration, rig):
        pass
    for can_id in (0x701, 0x702, 0x703, 0x77F):
        assert max(np.diff(heard[can_id][1:]), default=0) < 70_000_000  # the first is the boot-up
