"""What waits to be sent is bounded: a node whose frames never win keeps some, and what it loses is counted."""

from __future__ import annotations

from torquerig.device_sim.arbitration import ROOM
from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.wire.frame import Frame

FAR_NS = 10**9


def test_a_node_keeps_the_frames_that_it_has_room_for(talker):
    chatty = talker(1, *((0, Frame(0x181, number.to_bytes(2, "little"))) for number in range(ROOM + 20)))
    network = SimulatedNetwork(SimulatedDevices([chatty]), 1_000_000)
    heard = []
    while (arrival := network.run_until(FAR_NS)) is not None:
        heard.append(int.from_bytes(arrival.frame.data, "little"))
    assert heard == list(range(ROOM))
    assert network.statistics.dropped == 20


def test_room_that_became_free_is_used_again(talker):
    later = [(FAR_NS + number, Frame(0x181)) for number in range(ROOM)]
    network = SimulatedNetwork(
        SimulatedDevices([talker(1, *((0, Frame(0x181)) for _ in range(ROOM)), *later)]), 1_000_000
    )
    while network.run_until(2 * FAR_NS) is not None:
        pass
    assert network.statistics.frames == 2 * ROOM
    assert network.statistics.dropped == 0


def test_one_nodes_flood_takes_no_room_from_another(talker):
    flood = talker(1, *((0, Frame(0x7FF)) for _ in range(2 * ROOM)))
    network = SimulatedNetwork(SimulatedDevices([flood, talker(2, (1, Frame(0x182)))]), 1_000_000)
    network.run_until(1)
    arrivals = [network.run_until(FAR_NS) for _ in range(2)]
    assert [arrival.frame.can_id for arrival in arrivals] == [0x7FF, 0x182]


def test_the_masters_frames_always_find_room(talker):
    network = SimulatedNetwork(SimulatedDevices([talker(1)]), 1_000_000)
    for _ in range(3 * ROOM):
        network.submit(Frame(0x080))
    network.run_until(FAR_NS)
    assert network.statistics.frames == 3 * ROOM
