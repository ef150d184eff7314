"""What the rig's process answers when the drives fail under it, with devices made for the purpose."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import Pipe
from threading import Thread

import pytest

from torquerig import rig_host
from torquerig.assembly import build_simulation
from torquerig.device_sim.plant import TruthLog
from torquerig.driver.errors import BusError
from torquerig.errors import RigError
from torquerig.rig_host import RigHost
from torquerig.rig_orders import Begin, Begun, End, GoOn, PowerCycle, TellTruth
from torquerig.simulator import RunningDrives

GONE = "cannot receive on the bus (socketcan channel 'vcan0'): the interface is gone"


class Devices:
    """Devices whose bus goes away, or takes no frame."""

    origin_ns = 5

    def __init__(self, *, lives: int, lost: int = 0) -> None:
        self.now_ns = 0
        self.lost = lost
        self._lives = lives

    def serve(self, until_ns: int) -> None:
        self.now_ns = until_ns
        self._lives -= 1
        if self._lives < 0:
            raise BusError(GONE)

    def intervene(self, node_id: int, act) -> None:
        raise NotImplementedError


@pytest.fixture
def host(monkeypatch) -> Iterator:
    """The pipe to a host whose next rigs have these devices."""
    next_devices = [Devices(lives=1), Devices(lives=1, lost=3), Devices(lives=1 << 30)]

    @contextmanager
    def running_drives(configuration, **_) -> Iterator[RunningDrives]:
        simulation = build_simulation(configuration.rig, TruthLog())
        yield RunningDrives(simulation, next_devices.pop(0), "no scheduling")  # type: ignore[arg-type]

    def serve() -> None:
        with pytest.raises(EOFError):
            RigHost(theirs).serve()

    monkeypatch.setattr(rig_host, "running_drives", running_drives)
    ours, theirs = Pipe()
    thread = Thread(target=serve, daemon=True)
    thread.start()

    def ask(order: object) -> object:
        ours.send(order)
        assert ours.poll(20.0), f"no answer to {order}"
        return ours.recv()

    yield ask
    ours.close()
    thread.join()


def test_a_bus_that_goes_away_is_told_to_every_order_and_the_next_rig_starts_anew(host):
    begin = Begin("unix:/tmp/none")
    assert isinstance(host(TellTruth()), RigError)
    assert host(begin) == Begun("unix:/tmp/none", 1_000_000, (1, 2, 3), 5)
    for order in (PowerCycle(), TellTruth(), End()):
        answer = host(order)
        assert isinstance(answer, BusError)
        assert str(answer) == GONE
    assert str(host(begin)) == "unix:/tmp/none takes no frames: the drives' boot-up messages are lost"
    assert isinstance(host(begin), Begun)
    assert str(host(GoOn())) == "the drives cannot GoOn now"
    assert len(host(End()).at_ns) == 1
