"""For pytest: a fixture that gives a test simulated drives on a bus of their own.

    def test_my_master(simulated_rig):
        bus = can.Bus(interface=simulated_rig.interface, channel=simulated_rig.channel)

pytest imports this module at every start: all else is imported when a test first asks for the fixture.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from torquerig.rig_process import RigProcess
    from torquerig.simulated_rig import SimulatedRig

MARKER = "simulated_rig"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let the command line choose the bus."""
    parser.getgroup("torquerig").addoption(
        "--simulated-rig-bus",
        metavar="URL",
        help="the bus of the fixture simulated_rig: unix:FOLDER, socketcan:vcan0, INTERFACE:CHANNEL or lockstep:;"
        " default: a unix bus for each test",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Announce the marker."""
    config.addinivalue_line(
        "markers",
        f"{MARKER}(bus=None, *, plant=None, config=None, record=None, options=None): what the fixture {MARKER}"
        " simulates; the arguments of torquerig.SimulatedRig",
    )


@pytest.fixture(scope="session")
def simulated_rig_process() -> "Iterator[RigProcess]":
    """The process in which the rigs of a session live one after another; started when a test first needs it."""
    from torquerig.rig_process import RigProcess  # noqa: PLC0415

    process = RigProcess()
    yield process
    process.close()


@pytest.fixture
def simulated_rig(request: pytest.FixtureRequest, simulated_rig_process: "RigProcess") -> "Iterator[SimulatedRig]":
    """Three simulated drives, freshly switched on, on a bus of this test's own: a torquerig.SimulatedRig."""
    from torquerig.simulated_rig import SimulatedRig  # noqa: PLC0415

    marker = request.node.get_closest_marker(MARKER)
    given = marker.args if marker else ()
    keywords = dict(marker.kwargs) if marker else {}
    if not given:
        keywords.setdefault("bus", request.config.getoption("simulated_rig_bus"))
    with SimulatedRig(*given, process=simulated_rig_process, **keywords) as rig:
        yield rig
