"""The four that exchange a cycle's frames in the wire benchmark."""

import socket
import struct
from abc import ABC, abstractmethod
from contextlib import suppress
from time import perf_counter_ns
from typing import Any, Final

import can
import canopen
import numpy as np

from torquerig.benchmarks.wire_places import CAN_FRAME, DRIVES, RPDO, TPDO, Peer, Place
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.wire import cob
from torquerig.driver.wire.dictionary import DRIVE_EDS, load_dictionary

TORQUE: Final = 0.1  # [N·m] that is commanded, any will do
CONTROLWORD: Final = 0x0F  # enable operation
PATIENCE_S: Final = 1
TIMEVAL: Final = struct.Struct("@qq")  # struct timeval
DATA: Final = 8  # offset of the data in struct can_frame
AT_ONCE: Final = 0  # [ns], due long ago
REHEARSALS: Final = 3
"""Cycles at the beginning of a turn that are not timed: the group catches up with a clock that went on without it."""


class Contestant(ABC):
    """A way to do a cycle.

    Attributes:
        peer: Plays the drives.
    """

    def __init__(self, peer: Peer) -> None:
        self.peer = peer

    @abstractmethod
    def cycle(self) -> object:
        """Do a cycle; the peer answers the SYNC."""

    @abstractmethod
    def drain(self) -> None:
        """Take from the bus what others left there."""

    def close(self) -> None:
        """Leave the bus, and let the peer leave it."""
        self.peer.close()

    def turn(self, cycles: int) -> int:
        """Do cycles; how long they took without the peer [ns]."""
        peer = self.peer
        self.drain()
        for _ in range(REHEARSALS):
            self.cycle()
        peer.collect()
        peer.busy_ns = took_ns = 0
        for _ in range(cycles):
            began = perf_counter_ns()
            self.cycle()
            took_ns += perf_counter_ns() - began
            peer.collect()
        return took_ns - peer.busy_ns


class Floor(Contestant):
    """A bare socket, buffers made once, struct."""

    def __init__(self, place: Place, counts: int) -> None:
        self._socket, peer = place.bare()
        super().__init__(peer)
        self._counts = counts
        # a timeout of Python's would cost a poll before each call
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, TIMEVAL.pack(PATIENCE_S, 0))
        self._sync = CAN_FRAME.pack(cob.SYNC, 0, b"")
        self._in, self._out = bytearray(CAN_FRAME.size), bytearray(CAN_FRAME.size)

    def cycle(self) -> object:
        """Do a cycle; what each drive said."""
        link, room, out, counts = self._socket, self._in, self._out, self._counts
        link.send(self._sync)
        self.peer.answer()
        heard: dict[int, tuple[int, int, int]] = {}
        while len(heard) < len(DRIVES):
            link.recv_into(room)
            heard[room[0]] = TPDO.unpack_from(room, DATA)
        for node_id in DRIVES:
            CAN_FRAME.pack_into(out, 0, cob.RPDO[1] + node_id, RPDO.size, b"")
            RPDO.pack_into(out, DATA, CONTROLWORD, counts)
            link.send(out)
        return heard

    def drain(self) -> None:
        """Take what waits."""
        with suppress(BlockingIOError):
            while True:
                self._socket.recv_into(self._in, 0, socket.MSG_DONTWAIT)

    def close(self) -> None:
        """Leave the bus, and let the peer leave it."""
        super().close()
        self._socket.close()


class OnPythonCan(Contestant):
    """Somebody on a bus of python-can's."""

    def __init__(self, place: Place, counts: int) -> None:
        self._bus, peer = place.python_can()
        super().__init__(peer)
        self._counts = counts

    def drain(self) -> None:
        """Take what waits."""
        while self._bus.recv(0) is not None:
            pass

    def close(self) -> None:
        """Leave the bus, and let the peer leave it."""
        super().close()
        self._bus.shutdown()


class PythonCan(OnPythonCan):
    """python-can's messages, struct."""

    def cycle(self) -> object:
        """Do a cycle; what each drive said."""
        bus = self._bus
        bus.send(can.Message(arbitration_id=cob.SYNC, is_extended_id=False))
        self.peer.answer()
        heard: dict[int, tuple[int, int, int]] = {}
        while len(heard) < len(DRIVES):
            message = _next(bus)
            heard[message.arbitration_id] = TPDO.unpack(message.data)
        for node_id in DRIVES:
            data = RPDO.pack(CONTROLWORD, self._counts)
            bus.send(can.Message(arbitration_id=cob.RPDO[1] + node_id, data=data, is_extended_id=False))
        return heard


class Canopen(OnPythonCan):
    """The canopen library's PDO objects; its listener is called here, where its receive thread would."""

    def __init__(self, place: Place, counts: int) -> None:
        super().__init__(place, counts)
        self._network = canopen.Network()
        self._network.bus = self._bus
        self._tpdos, self._rpdos = [], []
        for node_id in DRIVES:
            node = canopen.RemoteNode(node_id, load_dictionary(DRIVE_EDS, node_id))
            self._network.add_node(node)
            self._tpdos.append(_mapped(node.tpdo[1], cob.TPDO[1] + node_id, 0x6041, 0x6064, 0x2077))
            self._rpdos.append(_mapped(node.rpdo[1], cob.RPDO[1] + node_id, 0x6040, 0x2071))
            node.tpdo[1].subscribe()

    def cycle(self) -> object:
        """Do a cycle; what each drive said."""
        network, bus, tpdos = self._network, self._bus, self._tpdos
        (listener,) = network.listeners
        for tpdo in tpdos:
            tpdo.is_received = False
        network.sync.transmit()
        self.peer.answer()
        while not all(tpdo.is_received for tpdo in tpdos):
            listener.on_message_received(_next(bus))  # type: ignore[no-untyped-call]  # canopen has no types
        heard = [[variable.raw for variable in tpdo.map] for tpdo in tpdos]
        for rpdo in self._rpdos:
            rpdo.map[0].raw = CONTROLWORD
            rpdo.map[1].raw = self._counts
            rpdo.transmit()
        return heard


class Ours(Contestant):
    """A group of axes: what the loop calls."""

    def __init__(self, group: AxisGroup, peer: Peer) -> None:
        super().__init__(peer)
        self._group = group
        self._torques = np.full(len(DRIVES), TORQUE)

    def cycle(self) -> object:
        """Do a cycle; the sample."""
        group = self._group
        sample = group.sample(AT_ONCE)
        if not sample.complete:
            raise RuntimeError("a drive that answered at once was not heard")
        group.command(self._torques, AT_ONCE)
        return sample

    def drain(self) -> None:
        """Take what waits: a group that heard another contestant would take it for a second master."""
        bus = self._group.session.pump.bus
        while bus.receive(bus.now_ns()) is not None:
            pass


def _mapped(pdo: Any, cob_id: int, *indices: int) -> Any:  # noqa: ANN401  (canopen has no types)
    """A PDO of the canopen library with its mapping, without asking the drive."""
    pdo.cob_id, pdo.enabled = cob_id, True
    pdo.clear()
    for index in indices:
        pdo.add_variable(index)
    return pdo


def _next(bus: can.BusABC) -> can.Message:
    message = bus.recv(PATIENCE_S)
    if message is None:
        raise RuntimeError("a TPDO that was sent did not arrive")
    return message
