"""The bus behind a serial CAN adapter, seen from the bus: another program plugs in at a pseudo-terminal.

    SlcanBus(Path("/tmp/ttyRIG"), bitrate=1_000_000)

That name is to the other program (slcand and the kernel's line discipline, python-can's interface `slcan`, a terminal)
a serial port with an adapter on it, which it opens, sets up, closes and opens again as it likes; the members of this
bus are what the adapter is wired to. Nothing here waits for the other program: what it does not read is kept up to a
limit, then lost and counted.
"""

from collections import deque
from pathlib import Path
from typing import Final

from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.interface import Clock, Tap
from torquerig.driver.bus.messages import check_frame
from torquerig.driver.bus.slcan_adapter import Channel, SlcanAdapter
from torquerig.driver.bus.slcan_terminal import PseudoTerminal
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame

BACKLOG: Final = 65_536
"""What is kept for a host that does not read [byte]: 0.3 s of a full bus at 1 Mbit/s."""

STALL_NS: Final = 2_000_000
"""So late, a look at the port was late because this process stood still."""


class SlcanBus:
    """A bus whose only way out is a serial CAN adapter's port.

    A frame sent while no host listens is no error, as on a wire that nobody else is on; `counts` tells.
    """

    def __init__(self, link: Path, *, bitrate: int, clock: Clock | None = None, tap: Tap | None = None) -> None:
        """Make the port.

        Args:
            link: The port's name, made as a symbolic link and removed by `close`.
            bitrate: The bus's bit rate, which the host has to choose too [bit/s].
            clock: Real time; by default one that sleeps without spinning.
            tap: Is told every frame of the bus, whether the host hears it or not.

        Raises:
            BusUrlError: The link's name is taken, or the link cannot be made.
        """
        self._terminal = PseudoTerminal(link)
        self._name = str(link)
        self._clock = clock or RealClock(spin_ns=0)
        self._tap = tap
        self._adapter = SlcanAdapter(bitrate)
        self._inbox: deque[Arrival] = deque()
        self._backlog = bytearray()
        self._looked_ns = self._clock.now_ns()
        self._closed = False

    @property
    def port(self) -> str:
        """The terminal that the link leads to."""
        return self._terminal.host_end

    @property
    def connected(self) -> bool:
        """Whether a host had the port open when last looked."""
        return self._terminal.connected

    @property
    def channel(self) -> Channel:
        """What the host has the adapter do on the bus."""
        return self._adapter.channel

    @property
    def counts(self) -> dict[str, int]:
        """What did not go well: see `SlcanAdapter.counts`."""
        return self._adapter.counts

    def now_ns(self) -> int:
        """Return the clock's time [ns]."""
        return self._clock.now_ns()

    def wait_until(self, due_ns: int) -> None:
        """Wait without looking at the port; what comes in queues meanwhile."""
        self._clock.wait_until(due_ns)

    def send(self, frame: Frame) -> None:
        """Tell the host of a frame; never blocks.

        Raises:
            BusError: The bus is closed.
            ValueError: It is not a classic CAN frame.
        """
        self._check_open()
        check_frame(frame)
        now_ns = self._clock.now_ns()
        if self._terminal.connected:
            self._keep(self._adapter.tell(frame, now_ns))
            self._flush()
        else:
            self._adapter.unheard()
        if self._tap is not None:
            self._tap(now_ns, frame)

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame of the host, or None once `until_ns` has come; what waits already comes first.

        Raises:
            BusError: The bus is closed.
        """
        self._check_open()
        while not self._inbox:
            self._flush()
            left_ns = until_ns - self._clock.now_ns()
            self._terminal.wait(max(left_ns, 0) / 1e9, for_room=bool(self._backlog))
            self._look(until_ns)
            if not self._inbox and self._looked_ns >= until_ns:
                return None
        arrival = self._inbox.popleft()
        if self._tap is not None:
            self._tap(*arrival)
        return arrival

    def close(self) -> None:
        """Take the port and its link away; may be called again."""
        self._closed = True
        self._terminal.close()

    def _look(self, until_ns: int) -> None:
        """Take what the host wrote, and give it what it has room for."""
        data = self._terminal.read()
        before_ns, self._looked_ns = self._looked_ns, self._clock.now_ns()
        if not self._terminal.connected:
            self._adapter.hang_up()
            self._backlog.clear()
            return
        heard = self._adapter.hear(data)
        self._keep(heard.replies)
        # A terminal has no time stamps. What is there after a stall came during all of it, and not just now: as no
        # drive may miss a command that was there in time, it is spread over the stall.
        late = self._looked_ns - until_ns > STALL_NS
        since_ns = self._looked_ns - before_ns if late else 0
        count = len(heard.frames)
        for number, frame in enumerate(heard.frames, 1 - count):
            self._inbox.append(Arrival(self._looked_ns + since_ns * number // count, frame))

    def _keep(self, data: bytes) -> None:
        """Keep bytes for the host; lose them all if too much is kept already."""
        if len(self._backlog) + len(data) > BACKLOG:
            self._adapter.overrun()
        else:
            self._backlog += data

    def _flush(self) -> None:
        """Give the host as much of what is kept as it has room for."""
        if self._backlog:
            del self._backlog[: self._terminal.write(self._backlog)]

    def _check_open(self) -> None:
        if self._closed:
            raise BusError(f"the bus at the serial port {self._name} is closed")
