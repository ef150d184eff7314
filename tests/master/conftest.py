"""A bus in virtual time with drives good enough to be configured, homed, enabled and stopped.

The drives obey CiA 402 by the wire package's table, and have no dynamics, no watchdogs and no pride: what they are to
refuse, forget or say wrongly is set by each test.
"""

from __future__ import annotations

import heapq
import struct
from collections.abc import Callable, Sequence
from functools import cache
from itertools import count
from math import pi

import pytest

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.errors import BusError
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.wire import cia402, emcy, nmt
from torquerig.driver.wire.cia402 import DriveState, walk
from torquerig.driver.wire.dictionary import DRIVE_EDS, load_dictionary, struct_code
from torquerig.driver.wire.emcy import Emergency
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.driver.wire.nmt import NmtCommand, NmtState
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

MS = 1_000_000
ANSWER_NS = 150_000  # from a frame to the drive's answer to it
FIXTURE_COUNTS = (27177, 102005, 139757)  # 48.9177, 183.6095 and 251.5625 degrees of 200 000 counts a revolution
Key = tuple[int, int]


@cache
def power_on_objects(node_id: int) -> tuple[dict[Key, str], dict[Key, int], dict[Key, bytes]]:
    """Struct codes, numbers and texts that the EDS gives a drive."""
    codes: dict[Key, str] = {}
    values: dict[Key, int] = {}
    texts: dict[Key, bytes] = {}
    for entry in load_dictionary(DRIVE_EDS, node_id).indices.values():
        for variable in [entry] if hasattr(entry, "data_type") else entry.subindices.values():
            key = (variable.index, variable.subindex)
            if isinstance(variable.default, str):
                texts[key] = variable.default.encode()
            else:
                codes[key], values[key] = struct_code(variable), variable.default or 0
    return codes, values, texts


class FakeDrive:
    """A drive that does as it is told.

    Attributes:
        refused: Objects whose writing is aborted, with the code.
        forgotten: Objects that take a value and keep their own.
        mute: Kinds of frames it does not answer: "sdo", "sync".
        barred: CiA 402 transitions that it does not make.
        fault_at_state: Falls into a fault of the code on reaching the state.
        fail_homing: Homing ends in an error.
        home_sign: -1 takes the home offset with the other sign.
    """

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.codes, values, texts = power_on_objects(node_id)
        self.values = dict(values)
        self.texts = dict(texts)
        self.refused: dict[tuple[int, int], AbortCode] = {}
        self.forgotten: set[tuple[int, int]] = set()
        self.mute: set[str] = set()
        self.barred: set[int] = set()
        self.fault_at_state: dict[DriveState, int] = {}
        self.nmt = NmtState.PRE_OPERATIONAL
        self.state = DriveState.SWITCH_ON_DISABLED
        self.encoder = 0
        self.zero = 0
        self.homed = False
        self.attained = False
        self.fail_homing = False
        self.home_sign = 1
        self.visited: list[DriveState] = [self.state]
        self.heard: list[Frame] = []
        self.sent: list[Frame] = []
        self._server = SdoServer(self)

    def read(self, index: int, subindex: int) -> bytes:
        key = (index, subindex)
        if key in self.texts:
            return self.texts[key]
        if key not in self.values:
            raise SdoAbort(AbortCode.NO_OBJECT)
        live = {(0x6041, 0): self.statusword, (0x6064, 0): self.position, (0x6061, 0): self.values[0x6060, 0]}
        return struct.pack("<" + self.codes[key], live.get(key, self.values[key]))

    def write(self, index: int, subindex: int, data: bytes) -> None:
        key = (index, subindex)
        if key in self.refused:
            raise SdoAbort(self.refused[key])
        if key not in self.values:
            raise SdoAbort(AbortCode.NO_OBJECT)
        value = struct.unpack("<" + self.codes[key], data)[0]
        if key == (0x6040, 0):
            self.obey(value)
        elif key not in self.forgotten:
            self.values[key] = value

    @property
    def statusword(self) -> int:
        word = cia402.STATE_BITS[self.state] | cia402.REMOTE | (cia402.REFERENCED if self.homed else 0)
        if self.values[0x6060, 0] == 6:
            outcome = cia402.HOMING_ERROR if self.fail_homing else cia402.HOMING_ATTAINED * self.attained
            word |= cia402.TARGET_REACHED | outcome
        return word

    @property
    def position(self) -> int:
        return self.encoder - self.zero

    def obey(self, controlword: int) -> None:
        previous = self.values[0x6040, 0]
        self.values[0x6040, 0] = controlword
        for transition in walk(self.state, controlword, previous, barred=self.barred):
            self.go(transition.target)
        start = controlword & ~previous & cia402.HOMING_START
        if start and self.state is DriveState.OPERATION_ENABLED and self.values[0x6060, 0] == 6:
            self.attained = not self.fail_homing
            if self.attained:
                self.zero = self.encoder - self.home_sign * self.values[0x607C, 0]
                self.homed = True

    def go(self, state: DriveState) -> None:
        self.state = state
        self.visited.append(state)
        if state in self.fault_at_state:
            self.fault(self.fault_at_state[state])

    def fault(self, code: int, *, told: bool = True) -> None:
        self.go(DriveState.FAULT)
        self.values[0x603F, 0] = code
        if told:
            self.sent.append(emcy.encode(Emergency(self.node_id, code, emcy.register_bits(code))))

    def hear(self, frame: Frame) -> list[Frame]:
        """What the drive answers to a frame."""
        self.heard.append(frame)
        command = nmt.decode_command(frame)
        if command is not None and command[1] in {0, self.node_id}:
            self._command_nmt(command[0])
        elif frame.can_id == 0x600 + self.node_id and "sdo" not in self.mute:
            answer = self._server.handle(frame.data)
            if answer is not None:
                self.sent.append(Frame(0x580 + self.node_id, answer))
        elif frame.can_id == 0x200 + self.node_id and self.nmt is NmtState.OPERATIONAL:
            controlword, self.values[0x2071, 0] = struct.unpack("<Hh", frame.data)
            self.obey(controlword)
        elif frame.can_id == 0x080 and self.nmt is NmtState.OPERATIONAL and "sync" not in self.mute:
            torque = self.values[0x2071, 0] if self.state is DriveState.OPERATION_ENABLED else 0
            data = struct.pack("<Hih", self.statusword, self.position, torque)
            self.sent.append(Frame(0x180 + self.node_id, data))
        answers, self.sent = self.sent, []
        return answers

    def _command_nmt(self, command: NmtCommand) -> None:
        self.nmt = {
            NmtCommand.START: NmtState.OPERATIONAL,
            NmtCommand.STOP: NmtState.STOPPED,
        }.get(command, NmtState.PRE_OPERATIONAL)


class FakeBus:
    """Virtual time; drives answer after ANSWER_NS, one after the other.

    Attributes:
        log: Every frame sent by the master, with its time.
        echo: Whether own frames come back.
        gone: Raises BusError from now on.
        on_send: Called with each frame before it is sent.
    """

    def __init__(self, drives: Sequence[FakeDrive] = (), *, echo: bool = False, start_ns: int = 10**9) -> None:
        self.drives = list(drives)
        self.log: list[tuple[int, Frame]] = []
        self.echo = echo
        self.gone = False
        self.on_send: Callable[[Frame], None] = lambda _frame: None
        self._now_ns = start_ns
        self._serial = count()
        self._arriving: list[tuple[int, int, Frame]] = []

    def now_ns(self) -> int:
        return self._now_ns

    def wait_until(self, due_ns: int) -> None:
        self._now_ns = max(self._now_ns, due_ns)

    def send(self, frame: Frame) -> None:
        if self.gone:
            raise BusError("cannot send on the bus (fake): the interface is gone")
        self.on_send(frame)
        self.log.append((self._now_ns, frame))
        if self.echo:
            self.inject(self._now_ns + ANSWER_NS // 2, frame)
        for drive in self.drives:
            for number, answer in enumerate(drive.hear(frame)):
                self.inject(self._now_ns + ANSWER_NS + number, answer)

    def inject(self, at_ns: int, frame: Frame) -> None:
        heapq.heappush(self._arriving, (at_ns, next(self._serial), frame))

    def receive(self, until_ns: int) -> Arrival | None:
        if self.gone:
            raise BusError("cannot receive on the bus (fake): the interface is gone")
        if self._arriving and self._arriving[0][0] <= max(until_ns, self._now_ns):
            at_ns, _, frame = heapq.heappop(self._arriving)
            self._now_ns = max(self._now_ns, at_ns)
            return Arrival(at_ns, frame)
        self._now_ns = max(self._now_ns, until_ns)
        return None

    def close(self) -> None:
        self.gone = True

    def sent_to(self, can_id: int) -> list[bytes]:
        """Data of all frames that the master sent with this identifier."""
        return [frame.data for _, frame in self.log if frame.can_id == can_id]


class FakeRig:
    """Drives on a bus, and the settings of their axes."""

    def __init__(self, node_ids: Sequence[int] = (1, 2, 3), *, echo: bool = False) -> None:
        self.drives = {node_id: FakeDrive(node_id) for node_id in node_ids}
        self.bus = FakeBus(list(self.drives.values()), echo=echo)
        homes = [each * 2 * pi / 200_000 for each in FIXTURE_COUNTS]
        profile = load_profile()
        self.axes = [AxisSettings(node_id, profile, home=home) for node_id, home in zip(node_ids, homes, strict=False)]

    def group(self) -> AxisGroup:
        return AxisGroup(self.bus, self.axes)


@pytest.fixture
def rig() -> FakeRig:
    return FakeRig()


@pytest.fixture
def make_rig() -> type[FakeRig]:
    return FakeRig


@pytest.fixture
def fake_bus() -> type[FakeBus]:
    return FakeBus
