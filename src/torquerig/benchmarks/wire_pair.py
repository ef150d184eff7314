"""The kernel CAN's code on pairs of Unix datagram sockets, for machines whose kernel has no CAN."""

import socket

import can
from can.interfaces.socketcan import SocketcanBus

from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.interface import Tap
from torquerig.driver.bus.kernel_can import KernelCanBus
from torquerig.driver.bus.kernel_can_port import SO_TIMESTAMPNS


class PairedCanBus(SocketcanBus):
    """python-can's SocketCAN bus on a socket that is one of a pair."""

    def __init__(self, ours: socket.socket) -> None:
        """Take the socket, and ask for timestamps as python-can does."""
        ours.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.socket = ours
        self.channel = "pair"
        self.channel_info = "a pair of Unix sockets"
        self._bcm_sockets = {}
        self._is_filtered = True
        can.BusABC.__init__(self, channel="pair")

    def _apply_filters(self, filters: object) -> None:
        """There is nobody else to be filtered out."""


class PairedKernelCanBus(KernelCanBus):
    """Our bus for the kernel's CAN on pairs of Unix sockets, which have no filters: whoever sends chooses the pair."""

    def __init__(self, bus: PairedCanBus, clock: RealClock, tap: Tap | None = None) -> None:
        """Take one of a pair over."""
        super().__init__(bus, clock, tap)
        self._theirs: list[socket.socket] = []

    def process_data(self) -> socket.socket | None:
        """The other end of the port's socket; None while there is no port."""
        return self._theirs[-1] if self._theirs else None

    def close_cyclic(self) -> None:
        """Close both ends."""
        super().close_cyclic()
        while self._theirs:
            self._theirs.pop().close()

    def _open_socket(self, can_ids: tuple[int, ...] | None) -> socket.socket:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        ours.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self._theirs.insert(0 if can_ids is None else len(self._theirs), theirs)
        return ours

    def _leave_out(self, _can_ids: tuple[int, ...]) -> None:
        """There are no filters."""

    def _let_all_in(self) -> None:
        """There are no filters."""
