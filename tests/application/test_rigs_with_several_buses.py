"""A drive or a few on each of several buses: the same motion, and the same stop when something breaks on one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np
import pytest

from torquerig import load_configuration, open_record, run_experiment
from torquerig.assembly import Rig, open_rig
from torquerig.axes import axis_settings, group_settings
from torquerig.buses import channel_names
from torquerig.cli import main
from torquerig.driver.errors import BusError, DriveFault, LinkLost, NoAnswer
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.sdo_jobs import Download
from torquerig.errors import ConfigurationError
from torquerig.record import BusLog
from torquerig.rig_host import configuration_of
from torquerig.rig_orders import Begin

TWO = {"axes.3.bus": "lockstep:b"}
THREE = {"axes.2.bus": "lockstep:b", "axes.3.bus": "lockstep:c"}
OVERCURRENT = 1  # what 2F00 takes
PUSH = np.array([0.05, 0.05, 0.05])
HOMES = {1: 0, 2: 0, 3: 1}  # of TWO
MS = 1_000_000
PERIOD_NS = 4 * MS
WATCHDOG_NS = 3 * PERIOD_NS


@pytest.fixture(scope="module")
def record(tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("records") / "two"
    run_experiment(load_configuration(options=TWO), record=place)
    return place


def test_two_wires_move_the_machine_as_one_does(record):
    one = run_experiment(load_configuration()).summary
    two = open_record(record).summary
    assert two.position_rmse_mm == pytest.approx(one.position_rmse_mm, rel=0.02)
    assert two.rms_torque_nm == pytest.approx(one.rms_torque_nm, rel=0.02)
    assert (two.cycles, two.overruns, two.bus) == (one.cycles, 0, "lockstep: and lockstep:b")


def test_each_bus_has_its_load_and_its_name_in_the_log(record):
    summary = open_record(record).summary
    assert set(summary.bus_loads) == {"lockstep", "b"}
    assert summary.bus_load == summary.bus_loads["lockstep"]
    # SYNC, two TPDOs, two RPDOs each 4 ms; SYNC, one and one; heartbeats, TPDO2 and what is passed on come on top
    assert 0.129 < summary.bus_loads["lockstep"] < 0.16
    assert 0.071 < summary.bus_loads["b"] < 0.1
    heard: dict[str, Counter[int]] = {"lockstep": Counter(), "b": Counter()}
    with can.LogReader(record / "bus.log") as reader:
        stamps = []
        for message in reader:
            heard[message.channel][message.arbitration_id] += 1
            stamps.append(message.timestamp)
    assert stamps == sorted(stamps)
    assert heard["lockstep"][0x080] == heard["b"][0x080] > 100
    assert {0x181, 0x182, 0x201, 0x202} <= set(heard["lockstep"])
    assert {0x183, 0x203} <= set(heard["b"])
    assert not {0x183, 0x203, 0x583} & set(heard["lockstep"])
    assert abs(heard["lockstep"][0x703] - heard["b"][0x703]) <= 1  # passed on


def test_two_records_of_one_command_hold_the_same_frames_of_both_buses(record, tmp_path):
    run_experiment(load_configuration(options=TWO), record=tmp_path / "again")
    assert (tmp_path / "again" / "bus.log").read_bytes() == (record / "bus.log").read_bytes()


@dataclass
class Scene:
    """A rig, the master of its drives, all frames that pass, and when the trouble began."""

    rig: Rig
    group: AxisGroup
    log: BusLog
    since_ns: int = 0

    def start(self, period_ns: int = PERIOD_NS) -> None:
        """Enable the drives and let them give torque."""
        self.group.home()
        self.group.enable()
        self.cycle(5, period_ns)

    def run_into(self, trouble: Callable[[], object]) -> None:
        """Enable the drives, let something happen, and go on."""
        self.start()
        self.since_ns = self.group.now_ns()
        trouble()
        self.cycle(10)

    def cycle(self, count: int, period_ns: int = PERIOD_NS) -> None:
        due_ns = self.group.now_ns() + period_ns
        for _ in range(count):
            self.group.sample(due_ns)
            self.group.command(PUSH, due_ns + period_ns // 2)
            due_ns += period_ns

    def demands(self) -> list[float]:
        return [self.rig.simulation.devices.nodes[node_id].torque_demand for node_id in (1, 2, 3)]

    def first(self, can_id: int, place: int, data: bytes) -> int:
        """How long after the trouble a frame that begins with these bytes was first on a bus [ns]."""
        return next(
            at_ns - self.since_ns
            for at_ns, where, frame in self.log.placed()
            if at_ns > self.since_ns
            if (where, frame.can_id) == (place, can_id)
            if frame.data[: len(data)] == data
        )


@contextmanager
def scene(options) -> Iterator[Scene]:
    configuration, log = load_configuration(options=options), BusLog()
    with open_rig(configuration, log) as rig:
        yield Scene(rig, AxisGroup(rig.bus, axis_settings(configuration), group_settings(configuration.rig)), log)


def test_at_2_khz_three_wires_carry_what_one_cannot():
    with pytest.raises(ConfigurationError, match="3 RPDOs a cycle would load"):
        load_configuration(options={"loop.rate_hz": 2000.0})
    with scene({**THREE, "loop.rate_hz": 2000.0}) as there, there.group as group:
        there.start(MS // 2)
        due_ns = group.now_ns() + MS // 2
        for _ in range(20):
            sample = group.sample(due_ns)
            assert sample.complete
            assert set(sample.answered_ns) == {210_000.0}  # SYNC, the drive's time, one TPDO: all buses alike
            group.command(PUSH, due_ns)
            due_ns += MS // 2
        assert all(demand > 0 for demand in there.demands())


@pytest.mark.parametrize("faulty", [3, 1])
def test_a_fault_on_one_bus_stops_the_drives_on_the_other_by_themselves(faulty):
    def job():
        yield Download(0x2F00, 0, OVERCURRENT.to_bytes(4, "little"))

    with scene(TWO) as there:
        with pytest.raises(DriveFault, match=f"^drive {faulty} is in fault: .*overcurrent"), there.group as group:
            there.run_into(lambda: group.session.service.run({faulty: job()}))
        assert there.demands() == [0.0, 0.0, 0.0]
    alarm_ns = there.first(0x080 + faulty, HOMES[faulty], b"\x10\x23")
    for node_id in {1, 2, 3} - {faulty}:  # 0xFF01: stopped because a sibling did; long before a watchdog would
        stopped_ns = there.first(0x080 + node_id, HOMES[node_id], b"\x01\xff")
        assert alarm_ns < stopped_ns < alarm_ns + PERIOD_NS // 2


def test_a_drive_that_restarts_stops_those_on_the_other_bus_by_its_heartbeat():
    with scene(TWO) as there:
        with pytest.raises(DriveFault), there.group as group:
            there.run_into(lambda: there.rig.simulation.devices.nodes[3].power_cycle(group.now_ns()))
        assert there.demands() == [0.0, 0.0, 0.0]
    boot_up_ns = there.first(0x703, HOMES[1], b"\x00")  # passed on
    for node_id in (1, 2):
        assert boot_up_ns < there.first(0x080 + node_id, HOMES[node_id], b"\x01\xff") < WATCHDOG_NS


def cut(rig: Rig, place: int, *, silently: bool) -> None:
    """Let nothing pass on one bus any more, in either direction."""
    member = rig.members[place]

    def lost(*_args: object) -> None:
        if not silently:
            raise LinkLost("the interface is gone")

    member.send = member.receive = lost


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize(("silently", "error", "periods"), [(False, BusError, 2), (True, NoAnswer, 6)])
def test_a_link_lost_on_one_bus_leaves_no_torque_on_any(place, silently, error, periods):
    with scene(TWO) as there:
        with pytest.raises(error), there.group as group:
            there.run_into(lambda: cut(there.rig, place, silently=silently))
        there.rig.members[1 - place].wait_until(group.now_ns() + 2 * WATCHDOG_NS)
        assert there.demands() == [0.0, 0.0, 0.0]
    for node_id, home in HOMES.items():
        if home != place:  # told by the driver: no torque, and 'disable voltage'
            assert there.first(0x200 + node_id, home, bytes(4)) < periods * PERIOD_NS
        else:  # by its own watchdog: SYNC is missing (0x8700) before RPDOs are
            assert there.first(0x080 + node_id, home, b"\x00\x87") < WATCHDOG_NS + PERIOD_NS


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({**TWO, "axes.3.node_id": 1}, "axes.3.node_id = 1 cannot be: axes.1.node_id has this node-id already"),
        ({"axes.2.bus": "socketcan:can1"}, "axes.2.bus = 'socketcan:can1' cannot be beside bus.url = 'lockstep:'"),
        (
            {"bus.url": "socketcan:can0", "axes.1.bus": "lockstep:"},
            "axes.1.bus = 'lockstep:' cannot be beside bus.url = 'socketcan:can0'",
        ),
        ({f"axes.{leg}.bus": "lockstep:b" for leg in (1, 2, 3)}, "bus.url = 'lockstep:' cannot be: no drive is there"),
        (
            {"bus.url": "unix:a/b", "axes.2.bus": "unix:./a/b/"},
            "axes.2.bus = 'unix:./a/b/' cannot be: it is 'unix:a/b'",
        ),
        ({**TWO, "axes.2.bus": ""}, 'axes.2.bus = "" cannot be'),
        ({**TWO, "loop.rate_hz": 2000.0}, "2 TPDOs and 2 RPDOs a cycle would load"),
    ],
)
def test_buses_that_cannot_be_those_of_one_rig_are_refused(options, sentence):
    with pytest.raises(ConfigurationError) as refused:
        load_configuration(options=options)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("urls", "names"),
    [
        (("lockstep:",), ("lockstep",)),
        (("lockstep:", "lockstep:b"), ("lockstep", "b")),
        (("socketcan:can0", "socketcan:can1"), ("can0", "can1")),
        (("unix:/run/a", "unix:/run/b"), ("a", "b")),
        (("unix:/run/a/bus", "unix:/run/b/bus"), ("unix1", "unix2")),
        (("unix:/run/a b", "socketcan:can1"), ("unix1", "socketcan2")),
    ],
)
def test_buses_have_names_that_differ_in_the_log(urls, names):
    assert channel_names(urls) == names


def test_the_simulated_rig_of_a_test_has_one_bus():
    with pytest.raises(ConfigurationError, match="puts its drives on one bus"):
        configuration_of(Begin(options={"axes.3.bus": "unix:b"}), "unix:a")


def test_the_commands_at_the_machine_reach_the_drives_on_every_bus(tmp_path, capsys):
    path = tmp_path / "two.toml"
    path.write_text('[bus]\nurl = "lockstep:"\n[axes.3]\nbus = "lockstep:b"\n', encoding="utf-8")
    assert main(["stop", "--config", str(path)]) == 0
    assert capsys.readouterr().out.count("'switch on disabled'") == 3
    assert main(["sdo", "read", "--config", str(path), "3", "1018:4"]) == 0
    assert capsys.readouterr().out.endswith("= 3\n")
    assert main(["nodes", "--config", str(path)]) == 0
    right, left = capsys.readouterr().out.split("lockstep:b:")
    assert right.startswith("lockstep::\n")
    assert [line[0] for line in right.splitlines()[2:4]] == ["1", "2"]
    assert [line[0] for line in left.splitlines()[2:]] == ["3"]
    assert main(["sdo", "read", "3", "1018:4"]) == 2
    assert "--bus" in capsys.readouterr().err


def test_stop_goes_on_with_the_other_buses_when_one_cannot_be_used(tmp_path, capsys):
    path = tmp_path / "two.toml"
    path.write_text(f'[bus]\nurl = "unix:{tmp_path}/a"\n[axes.3]\nbus = "nowhere:can9"\n', encoding="utf-8")
    assert main(["run", "--config", str(path)]) == 2
    assert capsys.readouterr().err.startswith("torquerig: 'nowhere:can9': there is no bus interface 'nowhere'")
    assert main(["stop", "--config", str(path)]) == 3
    told = capsys.readouterr().err
    assert told.startswith("torquerig: no answer from drives 1 and 2 ")  # they were asked, and there are none
    assert "'nowhere:can9'" in told
    assert main(["sim", "--config", str(path)]) == 2
    assert "'nowhere:can9'" in capsys.readouterr().err


def test_a_file_that_names_no_bus_does_not_do_for_a_command_that_needs_one(tmp_path, capsys):
    path = tmp_path / "none.toml"
    path.write_text("[loop]\nrate_hz = 250.0\n", encoding="utf-8")
    for command in ("nodes", "stop", "reset"):
        assert main([command, "--config", str(path)]) == 2
        assert "names no bus" in capsys.readouterr().err
    assert main(["sim", "--config", str(path)]) == 2
    assert "lockstep:" in capsys.readouterr().err
