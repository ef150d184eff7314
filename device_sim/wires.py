"""Several simulated wires in one time, each with its own arbitration, for drives that turn one machine.

The machine's time cannot go back, so no wire may run ahead of another: the wires advance together, from the earliest
thing that happens on any of them to the next. What a wire does is what it would do alone.
"""

from collections import deque
from collections.abc import Callable, Sequence

from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.wire.frame import Arrival, Frame


class SimulatedWires:
    """Wires whose time passes together, and the one master that is on all of them.

    Attributes:
        ends: The master's end of each wire, in their order; its calls are what makes time pass, on all of them.
    """

    def __init__(self, networks: Sequence[SimulatedNetwork]) -> None:
        """Join wires at time 0.

        Args:
            networks: The wires; from now on nobody else advances them.
        """
        self._now_ns = 0
        self.ends = tuple(WireEnd(network, self) for network in networks)

    def now_ns(self) -> int:
        """Return the simulated time [ns]."""
        return self._now_ns

    def advance(self, until_ns: int) -> bool:
        """Advance to the first time at which a frame reaches the master, no later than `until_ns`.

        Frames that start at `until_ns` do not start yet; see `SimulatedNetwork.run_until`.

        Returns:
            Whether one did. The frames of that time wait in `WireEnd.run_until`, and time stands there; else at
            `until_ns`, or where it stood if that is in the past.
        """
        ends = self.ends
        while True:
            next_ns = min([end.due_ns for end in ends])
            if next_ns > until_ns:
                self._now_ns = max(self._now_ns, until_ns)
                return False
            self._now_ns = max(self._now_ns, next_ns)
            heard = [end.catch_up() for end in ends if end.due_ns <= next_ns]
            if any(heard):
                return True


class WireEnd:
    """The master's end of one of several wires; what `LockstepBus` takes for its wire.

    Attributes:
        due_ns: When something happens on this wire next [ns].
    """

    def __init__(self, network: SimulatedNetwork, wires: SimulatedWires) -> None:
        self._network = network
        self._wires = wires
        self._inbox: deque[Arrival] = deque()
        self.due_ns = network.next_ns()

    def now_ns(self) -> int:
        """Return the simulated time, the same on all wires [ns]."""
        return self._wires.now_ns()

    def submit(self, frame: Frame) -> None:
        """Put a frame into the master's send queue now; it takes part in arbitration."""
        self.catch_up()  # nothing happens by it, but the wire's own time may stand where something last did
        self._network.submit(frame)
        self.due_ns = self._network.next_ns()

    def run_until(self, until_ns: int) -> Arrival | None:
        """Return the next frame that reaches the master on this wire, time advancing to it, or None at `until_ns`."""
        while not self._inbox and self._wires.advance(until_ns):
            pass
        return self._inbox.popleft() if self._inbox else None

    def watch(self, tap: Callable[[int, Frame], None]) -> None:
        """Tell `tap` every frame on this wire from now on, at its end [ns]."""
        self._network.watch(tap)

    def intervene(self, node_id: int, act: Callable[[int], None]) -> None:
        """Do something to a device on this wire now; see `SimulatedNetwork.intervene`."""
        self.catch_up()
        self._network.intervene(node_id, act)
        self.due_ns = self._network.next_ns()

    def catch_up(self) -> bool:
        """Advance this wire to the time of all; whether frames came of it, which wait now."""
        before = len(self._inbox)
        while (arrival := self._network.run_until(self._wires.now_ns())) is not None:
            self._inbox.append(arrival)
        self.due_ns = self._network.next_ns()
        return len(self._inbox) > before
