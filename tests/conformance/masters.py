"""The library canopen as a master: its nodes, and waiting for what must come, however slow the machine is."""

import time
from collections.abc import Callable
from functools import cache
from importlib.resources import files

import canopen
import pytest
from canopen.nmt import NMT_STATES
from canopen.pdo import PdoMap
from canopen.profiles.p402 import BaseNode402
from stations import PATIENCE_S

EDS = str(files("torquerig.driver") / "data" / "torquerig-drive.eds")


@cache
def dictionary(node_id: int) -> canopen.ObjectDictionary:
    """Return what canopen makes of the EDS; its reader takes a tenth of a second."""
    return canopen.import_od(EDS, node_id)


def join(network: canopen.Network, node_id: int) -> BaseNode402:
    """Return a node of the network, by the EDS."""
    node = BaseNode402(node_id, dictionary(node_id))
    network.add_node(node)
    node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    return node


def shows(section: str) -> pytest.MarkDecorator:
    """Return the mark of a fact that canopen shows."""
    return pytest.mark.conformance(section, "canopen")


def await_true(condition: Callable[[], object]) -> None:
    """Wait until the condition holds, and fail when it does not in good time."""
    give_up = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.002)


def await_state(node: BaseNode402, state: int) -> None:
    """Wait until the node's heartbeat tells the NMT state."""
    await_true(lambda: node.nmt.wait_for_heartbeat(PATIENCE_S) and node.nmt.state == NMT_STATES[state])


def await_boot_up(node: BaseNode402, command: int) -> None:
    """Reset the node, and wait for its boot-up message."""
    states: list[int] = []
    node.nmt.add_heartbeat_callback(states.append)
    node.nmt.send_command(command)
    await_true(lambda: 0 in states)


def await_pdo(pdo: PdoMap, ask: Callable[[], object]) -> None:
    """Ask for a PDO, and wait until it comes."""
    heard: list[PdoMap] = []
    pdo.add_callback(heard.append)
    ask()
    await_true(lambda: heard)


def abort_code(action: Callable[[], object]) -> int:
    """Return the code with which the server aborts what the action asks for."""
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        action()
    code: int = aborted.value.code
    return code
