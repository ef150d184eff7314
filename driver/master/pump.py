"""The one hold on the bus: what is due is sent, what arrives is handed out by its COB-ID.

Whoever waits for anything waits in `Pump.serve`, so that SYNC, heartbeat and RPDOs go on whatever else is under way.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

from torquerig.driver.bus.interface import Bus
from torquerig.driver.wire import cob, nmt
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.driver.wire.nmt import NmtState

MILLISECOND_NS: Final = 1_000_000
SECOND_NS: Final = 1_000_000_000
FAR_NS: Final = 1 << 62  # later than any time: "not due at all"

Handler = Callable[[int, bytes], None]


class Timed(Protocol):
    """Something that is to happen at a time.

    Attributes:
        due_ns: When [ns]. While a loop leads the cycle it gets no earlier.
    """

    due_ns: int

    def fire(self, now_ns: int) -> None:
        """Do what is due, and set `due_ns` to the next time."""
        ...


@dataclass(slots=True)
class PumpCounts:
    """What passed the pump without being of use.

    Attributes:
        unknown: Frames that nobody here waits for.
        malformed: Frames on an awaited COB-ID with a wrong length or content.
        echoed: Own frames that the bus gave back.
    """

    unknown: int = 0
    malformed: int = 0
    echoed: int = 0


@dataclass(slots=True)
class Pump:
    """Serves one bus from one thread.

    Attributes:
        bus: The bus.
        handlers: Who takes a frame, by COB-ID: called with its time [ns] and data, and never raises.
        counts: What was of no use.
        quiet_ns: Nothing is due before, as `fire` saw it last [ns]; 0 once something was added. Whoever leads the cycle
            may trust it.
        echoes: Whether the bus gives own frames back, see `learn_echo`; then a frame on a COB-ID that was sent to is
            taken for the echo as often as it was sent, and only what exceeds that is somebody else's.
    """

    bus: Bus
    handlers: dict[int, Handler] = field(default_factory=dict)
    counts: PumpCounts = field(default_factory=PumpCounts)
    echoes: bool = False
    quiet_ns: int = 0
    _timed: tuple[Timed, ...] = ()  # a new one at each change, so that what is fired may add and remove
    _awaited_echoes: dict[int, int] = field(default_factory=dict)

    def now_ns(self) -> int:
        """The bus clock [ns]."""
        return self.bus.now_ns()

    def add_timed(self, timed: Timed) -> None:
        """Let something happen whenever it is due, from now on."""
        self._timed = (*self._timed, timed)
        self.quiet_ns = 0  # so that whoever trusts it looks again

    def remove_timed(self, timed: Timed) -> None:
        """Let it happen no more; nothing if it does not."""
        self._timed = tuple(each for each in self._timed if each is not timed)

    def send(self, frame: Frame) -> None:
        """Put a frame on the bus.

        Raises:
            BusError: The bus does not take it.
        """
        if self.echoes:
            self._awaited_echoes[frame.can_id] = self._awaited_echoes.get(frame.can_id, 0) + 1
        self.bus.send(frame)

    def serve(self, until_ns: int, done: Callable[[], bool] | None = None) -> bool:
        """Serve the bus until a time, or until something is done.

        All frames that arrived by then are handed out, and whatever is due is sent.

        Args:
            until_ns: When to return [ns].
            done: Asked after each frame and each due event.

        Returns:
            Whether it is done; False without a `done`.

        Raises:
            BusError: The bus is gone.
        """
        receive = self.bus.receive
        while done is None or not done():
            arrival = receive(self.next_ns(until_ns))
            if arrival is not None:
                self.hand_out(arrival)
            # a frame's own time will do: reading a clock at each frame is dear where that is a system call
            now_ns = self.bus.now_ns() if arrival is None else arrival.at_ns
            self.fire(now_ns)
            # on a bus that never falls silent the queue never empties: frames younger than the deadline can wait
            if now_ns >= until_ns:
                return done is not None and done()
        return True

    def next_ns(self, until_ns: int) -> int:
        """When something is due, or else `until_ns` [ns]."""
        for timed in self._timed:
            until_ns = min(until_ns, timed.due_ns)
        return until_ns

    def fire(self, now_ns: int) -> int:
        """Let happen what is due; when something is due next [ns]."""
        next_ns = FAR_NS
        all_timed = self._timed
        for timed in all_timed:
            if timed.due_ns <= now_ns:
                timed.fire(now_ns)
            if timed.due_ns < next_ns:  # noqa: PLR1730  (min costs a call each)
                next_ns = timed.due_ns
        self.quiet_ns = next_ns if self._timed is all_timed else 0
        return next_ns

    def learn_echo(self, frame: Frame, patience_ns: int) -> None:
        """Send a frame of our own and learn whether the bus gives it back."""
        heard: list[int] = []
        before = self.handlers.get(frame.can_id)
        self.handlers[frame.can_id] = lambda at_ns, _data: heard.append(at_ns)
        try:
            self.send(frame)
            self.echoes = self.serve(self.now_ns() + patience_ns, lambda: bool(heard))
        finally:
            del self.handlers[frame.can_id]
            if before is not None:
                self.handlers[frame.can_id] = before

    def hand_out(self, arrival: Arrival) -> None:
        """Give a frame to whoever waits for it."""
        frame = arrival.frame
        if self.echoes and self._awaited_echoes.get(frame.can_id):
            self._awaited_echoes[frame.can_id] -= 1
            self.counts.echoed += 1
            return
        handler = self.handlers.get(frame.can_id)
        if handler is None or frame.remote or frame.extended:
            self.counts.unknown += 1
        else:
            handler(arrival.at_ns, frame.data)


class HeartbeatProducer:
    """The master's own heartbeat (CiA 301, 7.2.8.2.2), which the drives watch.

    Attributes:
        due_ns: When the next one goes out [ns].
    """

    __slots__ = ("_frame", "_period_ns", "_pump", "due_ns")

    def __init__(self, pump: Pump, node_id: int, period_ns: int) -> None:
        self._pump = pump
        self._frame = nmt.encode_heartbeat(node_id, NmtState.OPERATIONAL)
        self._period_ns = period_ns
        self.due_ns = pump.now_ns()

    def fire(self, now_ns: int) -> None:
        """Send it, and never two at once after a delay."""
        self._pump.send(self._frame)
        self.due_ns = max(self.due_ns + self._period_ns, now_ns + self._period_ns // 2)


class GuardPoller:
    """Asks guarded nodes for their state (CiA 301, 7.2.8.2.1), which feeds their life guarding.

    Attributes:
        due_ns: When they are asked next [ns].
    """

    __slots__ = ("_frames", "_period_ns", "_pump", "due_ns")

    def __init__(self, pump: Pump, node_ids: tuple[int, ...], period_ns: int) -> None:
        self._pump = pump
        self._frames = tuple(nmt.encode_guard_request(node_id) for node_id in node_ids)
        self._period_ns = period_ns
        self.due_ns = pump.now_ns()

    def fire(self, now_ns: int) -> None:
        """Ask all of them."""
        for frame in self._frames:
            self._pump.send(frame)
        self.due_ns = now_ns + self._period_ns


def name_drives(node_ids: list[int] | tuple[int, ...]) -> str:
    """Drives in words: "drive 2", "drives 1 and 3", "drives 1, 2 and 3"."""
    ids = [str(node_id) for node_id in node_ids]
    if len(ids) == 1:
        return f"drive {ids[0]}"
    return f"drives {', '.join(ids[:-1])} and {ids[-1]}"


def heartbeat_cob(node_id: int) -> int:
    """The COB-ID of a node's error control."""
    return cob.HEARTBEAT + node_id
