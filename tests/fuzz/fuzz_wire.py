"""A wire between a driver and simulated drives on which frames are lost, doubled, delayed, spoilt and invented.

What reaches the driver is kept as a log; a `ReplayedWire` gives a driver the same frames at the same times again.
"""

import heapq
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Final

from fuzz_frames import NODE_IDS, spoilt
from fuzz_log import MICROSECOND, Timed
from fuzz_maker import FrameMaker
from fuzz_source import Source, choose, in_one_of

from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.errors import BusError
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Arrival, Frame

NEVER_NS: Final = 1 << 62
_MILLE: Final = 1000
_SPECIFIERS: Final = (0x43, 0x4B, 0x4F, 0x42, 0x41, 0x40, 0x60, 0x80, 0x00, 0x01, 0x10, 0x20, 0x30, 0xA0, 0xC0, 0xE0)
_DELAYS_US: Final = (0, 50, 200, 1_000, 4_000, 9_000, 20_000, 120_000, 400_000)
_IDEAS_US: Final = (100, 500, 1_000, 2_000, 5_000, 20_000)


@dataclass(frozen=True, slots=True)
class Hostility:
    """How often which harm is done, in a thousand frames.

    Attributes:
        drop: They are lost.
        repeat: They come twice.
        delay: They come late, so that others overtake them.
        spoil: Something in them changes.
        lie: SDO answers keep their object and say anything.
        invents: Frames come that nobody sent.
        endless: A server announces no length and never says that a segment is the last.
        at_drives: All this happens to what the drives hear, too.
    """

    drop: int = 0
    repeat: int = 0
    delay: int = 0
    spoil: int = 0
    lie: int = 0
    invents: bool = False
    endless: bool = False
    at_drives: bool = False


HONEST: Final = Hostility()


def some_hostility(source: Source) -> Hostility:
    """More or less of everything."""
    rates = [choose(source, (0, 0, 1, 10, 100, 500)) for _ in range(5)]
    flags = [in_one_of(source, times) for times in (2, 24, 2)]
    return Hostility(*rates, *flags)


class TorqueGate:
    """Judges what the driver sends: a torque only while every drive's last statusword said 'operation enabled'.

    Attributes:
        odd: Remote and extended frames that the driver was given: it has a use for none of them.
    """

    def __init__(self) -> None:
        self.odd = 0
        self._status: dict[int, int] = {}

    def heard(self, frame: Frame) -> None:
        """The driver is given a frame."""
        self.odd += frame.remote or frame.extended
        node_id = frame.can_id - cob.TPDO[1]
        if node_id in NODE_IDS and not (frame.remote or frame.extended) and len(frame.data) >= 8:
            self._status[node_id] = int.from_bytes(frame.data[:2], "little")

    def sent(self, frame: Frame) -> None:
        """The driver sends a frame."""
        if frame.can_id - cob.RPDO[1] in NODE_IDS and frame.data[0] & 0x0F == 0x0F and any(frame.data[2:]):
            states = {node_id: status & 0x6F for node_id, status in self._status.items()}
            assert all(states.get(node_id) == 0x27 for node_id in NODE_IDS), f"{frame} at states {states}"


class HostileWire:
    """Satisfies `SimulatedWire`.

    Attributes:
        hostility: What is done to frames from now on.
        log: What reached the driver.
        end_ns: Nobody should still be waiting then.
        unplugged: The driver's end is off the wire: whatever it tries raises BusError.
        touched_drives: Drives have heard what the driver did not say.
    """

    def __init__(self, network: SimulatedNetwork, source: Source) -> None:
        """Lie between a driver and a network; some such wires give a driver its own frames back."""
        self.hostility = HONEST
        self.log: list[Timed] = []
        self.end_ns = NEVER_NS
        self.unplugged = False
        self.touched_drives = False
        self.gate = TorqueGate()
        self._echoes = in_one_of(source, 3)
        self._network = network
        self._source = source
        self._maker = FrameMaker(source)
        self._on_its_way: list[tuple[int, int, Frame]] = []
        self._serial = count()
        self._idea_ns = NEVER_NS
        self._asked: dict[int, int] = {}  # the first byte of the last SDO request, by drive

    def now_ns(self) -> int:
        """The simulated time [ns]."""
        return self._network.now_ns()

    def watch(self, tap: Callable[[int, Frame], None]) -> None:
        """Nobody needs to know."""

    def become(self, hostility: Hostility) -> None:
        """Treat frames otherwise from now on."""
        self.hostility = hostility
        self._idea_ns = self.now_ns() + MICROSECOND if hostility.invents else NEVER_NS

    def submit(self, frame: Frame) -> None:
        """Take a frame of the driver's.

        Raises:
            BusError: The driver is unplugged.
        """
        _check_plug(self)
        self.gate.sent(frame)
        if frame.can_id - cob.SDO_REQUEST in NODE_IDS:
            self._asked[frame.can_id - cob.SDO_REQUEST] = frame.data[0]
        for each in self._harmed(frame) if self.hostility.at_drives else (frame,):
            self._network.submit(each)
        if self._echoes:
            for each in self._harmed(frame):
                self._bring(each, MICROSECOND)  # not at once: who replays it has to send first

    def run_until(self, until_ns: int) -> Arrival | None:
        """Advance to the next frame that reaches the driver.

        Raises:
            BusError: The driver is unplugged.
        """
        _check_plug(self)
        until_ns = max(until_ns, self.now_ns())
        while True:
            due_ns = self._on_its_way[0][0] if self._on_its_way else NEVER_NS
            stop_ns = min(until_ns, max(self.now_ns(), min(due_ns, self._idea_ns)))
            assert stop_ns <= self.end_ns, f"the driver still waits at {self.now_ns() / 1e9:.3f} s"
            arrival = self._network.run_until(stop_ns)
            if arrival is not None:
                self._pass_on(arrival)
            elif due_ns <= stop_ns:
                return self._deliver()
            elif self._idea_ns <= stop_ns:
                self._invent()
            else:
                return None

    def _deliver(self) -> Arrival:
        _, _, frame = heapq.heappop(self._on_its_way)
        self.log.append(Timed(self.now_ns(), frame))
        self.gate.heard(frame)
        return Arrival(self.now_ns(), frame)

    def _pass_on(self, arrival: Arrival) -> None:
        frame = arrival.frame
        if frame.can_id - cob.SDO_RESPONSE in NODE_IDS:
            frame = self._answer(frame)
        for each in self._harmed(frame):
            delayed = self._source.integer(0, _MILLE - 1) < self.hostility.delay if self.hostility.delay else False
            self._bring(each, choose(self._source, _DELAYS_US) * MICROSECOND if delayed else 0)

    def _bring(self, frame: Frame, delay_ns: int = 0) -> None:
        """Let the driver hear a frame, at a whole microsecond, for so the log tells it."""
        at_ns = -(-(self.now_ns() + delay_ns) // MICROSECOND) * MICROSECOND
        heapq.heappush(self._on_its_way, (at_ns, next(self._serial), frame))

    def _harmed(self, frame: Frame) -> Sequence[Frame]:
        """What becomes of a frame: itself mostly, nothing, two of it, another one."""
        hostility, source = self.hostility, self._source
        if not hostility.drop + hostility.repeat + hostility.spoil:
            return (frame,)
        luck = source.integer(0, _MILLE - 1)
        if luck >= hostility.drop + hostility.repeat + hostility.spoil:
            return (frame,)
        self.touched_drives = self.touched_drives or hostility.at_drives
        if luck < hostility.drop:
            return ()
        return (frame, frame) if luck < hostility.drop + hostility.repeat else (spoilt(source, frame),)

    def _answer(self, frame: Frame) -> Frame:
        """An SDO answer, or a lie in its place."""
        hostility, source, data = self.hostility, self._source, frame.data
        asked = self._asked.get(frame.can_id - cob.SDO_RESPONSE, 0)
        if hostility.endless and asked >> 5 == 2:  # an upload: it shall have segments, nobody knows how many
            return frame._replace(data=b"\x40" + data[1:4] + bytes(4))
        if hostility.endless and asked >> 5 == 3:  # a segment: here it is, and it is not the last
            return frame._replace(data=bytes((asked & 0x10,)) + bytes(7))
        if not hostility.lie or source.integer(0, _MILLE - 1) >= hostility.lie:
            return frame
        return frame._replace(data=bytes((choose(source, _SPECIFIERS),)) + data[1:4] + source.octets(4))

    def _invent(self) -> None:
        self._idea_ns = self.now_ns() + choose(self._source, _IDEAS_US) * MICROSECOND
        for frame in self._maker.burst():
            self._bring(frame)
            if self.hostility.at_drives:
                self.touched_drives = True
                self._network.submit(frame)


class ReplayedWire:
    """Gives a driver the frames of a log at their times, whatever it says; satisfies `SimulatedWire`."""

    def __init__(self, log: Sequence[Timed]) -> None:
        self.gate = TorqueGate()
        self.end_ns = NEVER_NS
        self.unplugged = False
        self._coming = deque(log)
        self._now_ns = 0

    def now_ns(self) -> int:
        """The simulated time [ns]."""
        return self._now_ns

    def watch(self, tap: Callable[[int, Frame], None]) -> None:
        """Nobody needs to know."""

    def submit(self, frame: Frame) -> None:
        """Judge a frame of the driver's; nobody hears it."""
        _check_plug(self)
        self.gate.sent(frame)

    def run_until(self, until_ns: int) -> Arrival | None:
        """Advance to the next frame of the log."""
        _check_plug(self)
        until_ns = max(until_ns, self._now_ns)
        assert min(until_ns, self._coming[0].at_ns if self._coming else until_ns) <= self.end_ns, "the driver waits"
        if not self._coming or self._coming[0].at_ns > until_ns:
            self._now_ns = until_ns
            return None
        at_ns, frame = self._coming.popleft()
        self._now_ns = max(self._now_ns, at_ns)
        self.gate.heard(frame)
        return Arrival(self._now_ns, frame)


def _check_plug(wire: HostileWire | ReplayedWire) -> None:
    if wire.unplugged:
        raise BusError("cannot use the bus (fuzz): the interface is gone")
