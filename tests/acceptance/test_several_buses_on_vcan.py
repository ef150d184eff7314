"""Two of the kernel's CAN links as one bus: waited for together, and one that goes down keeps nobody else waiting."""

from __future__ import annotations

import time
from collections.abc import Iterator

import can
import links
import pytest

from torquerig.driver.errors import LinkLost
from torquerig.driver.wire.frame import Frame
from torquerig.several_buses import open_real_time

pytestmark = pytest.mark.vcan
LINK = "vcan8"
URLS = ("socketcan:vcan0", f"socketcan:{LINK}")
SYNC = Frame(0x080)
PATIENCE_S = 60.0


@pytest.fixture
def link() -> Iterator[None]:
    links.add(LINK)
    links.switch(LINK, up=True)
    yield
    links.delete(LINK)


@pytest.mark.usefixtures("link")
def test_frames_of_two_links_come_in_order_and_a_link_that_goes_down_is_told():
    bus = open_real_time(URLS, {1: 0, 3: 1}, 1_000_000, lambda _place: None, spin_ns=0)
    with (
        can.Bus(interface="socketcan", channel="vcan0") as right,
        can.Bus(interface="socketcan", channel=LINK) as left,
    ):
        bus.send(SYNC)
        assert [each.recv(PATIENCE_S).arbitration_id for each in (right, left)] == [0x080, 0x080]
        for member, node_id in ((left, 3), (right, 1)):
            member.send(can.Message(arbitration_id=0x180 + node_id, data=bytes(8), is_extended_id=False))
        until_ns = time.monotonic_ns() + round(PATIENCE_S * 1e9)
        assert [bus.receive(until_ns).frame.can_id for _ in range(2)] == [0x183, 0x181]
        links.switch(LINK, up=False)
        bus.send(SYNC)
        assert right.recv(PATIENCE_S).arbitration_id == 0x080
        with pytest.raises(LinkLost, match=LINK):
            bus.receive(until_ns)
        bus.send(Frame(0x201, bytes(4)))
        assert right.recv(PATIENCE_S).arbitration_id == 0x201
    bus.close()
