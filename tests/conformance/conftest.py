"""Fixtures of the conformance suite, and the plugin that counts its facts and writes docs/conformance.md."""

import contextlib
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

sys.path.insert(0, str(Path(__file__).parent))  # for the modules beside this one

import facts
import links
import masters
from conversation import FACTORY, QUIET, Line, talk
from node_canopen import AbsentMaster, NodeMaster, NoNodeError, eds_of_node_1, packages
from stations import RealLine, Station, WireLine, running
from timeline import Bench

VCAN = pytest.param("vcan", marks=pytest.mark.vcan)
OWN_LINK = "conformance0"  # the drives stay on it while other tests use vcan0
TABLE = "--conformance-table"


class Tally:
    """Knows which test shows which fact, and how it went."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._checks: dict[str, facts.Check] = {}
        self._outcomes: dict[facts.Check, str] = {}

    @pytest.hookimpl(tryfirst=True)  # before tests that run in a guest are replaced by their forwarders
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        self._checks = {item.nodeid: check for item in items if (check := facts.check_of(item)) is not None}
        path = self._config.getoption(TABLE, default=None)
        if path is not None:
            Path(path).write_text(facts.table(self._checks.values()))

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> None:
        """Has npm's packages installed before a guest, which has no network, needs them."""
        judges = {self._checks[item.nodeid].judge for item in session.items if item.nodeid in self._checks}
        if "node-canopen" in judges and not self._config.option.collectonly:
            with contextlib.suppress(NoNodeError):  # the tests will say so
                packages()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        check = self._checks.get(report.nodeid)
        if check is not None and (report.when == "call" or report.outcome != "passed"):
            self._outcomes[check] = report.outcome

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self._outcomes:
            terminalreporter.section("conformance")
            for line in facts.summary(self._outcomes):
                terminalreporter.write_line(line)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(TABLE, metavar="FILE", help="write the table of the conformance facts that were collected")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "conformance(section, judge, bus=None): the test shows a conformance fact")
    config.pluginmanager.register(Tally(config), "conformance")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test that talks over a line runs on every bus, one that joins a station on those in real time."""
    if "bus" in metafunc.fixturenames:
        wire = ["wire"] if "line" in metafunc.fixturenames else []
        metafunc.parametrize("bus", [*wire, "unix", VCAN], scope="session")


@contextmanager
def bus_of(kind: str) -> Iterator[tuple[str, str]]:
    """Yield python-can's name and channel of a real-time bus that nobody else is on."""
    if kind == "vcan":
        links.add(OWN_LINK)
        links.switch(OWN_LINK, up=True)
        yield "socketcan", OWN_LINK
        links.delete(OWN_LINK)
        return
    with tempfile.TemporaryDirectory(prefix="rig-") as folder:
        yield kind, str(Path(folder) / "bus")


@pytest.fixture(scope="session")
def station(bus: str) -> Iterator[Station]:
    with bus_of(bus) as (interface, channel), running(interface, channel) as station:
        yield station


@pytest.fixture(scope="session")
def wire() -> WireLine:
    return WireLine()


@pytest.fixture
def line(request: pytest.FixtureRequest, bus: str) -> Iterator[Line]:
    """Node 1, which is quiet, and its siblings, all fresh from the factory, over a bus."""
    if bus == "wire":
        line: WireLine = request.getfixturevalue("wire")
        line.overhear()
        talk(line, FACTORY + QUIET)
        yield line
        return
    station: Station = request.getfixturevalue("station")
    with station.open() as member:
        line = RealLine(member)
        talk(line, FACTORY + QUIET)
        yield line


@pytest.fixture
def network(station: Station) -> Iterator[canopen.Network]:
    """canopen as the master of drives that are fresh from the factory."""
    with station.open() as member:
        talk(RealLine(member), FACTORY)
    network = canopen.Network()
    network.connect(interface=station.interface, channel=station.channel)
    yield network
    network.disconnect()


@pytest.fixture
def node(network: canopen.Network) -> BaseNode402:
    """Node 1 as canopen sees it."""
    return masters.join(network, 1)


@pytest.fixture(scope="session")
def node_process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeMaster | AbsentMaster]:
    try:
        master = NodeMaster(packages(), eds_of_node_1(tmp_path_factory.mktemp("node-canopen")))
    except NoNodeError as error:
        master = AbsentMaster(error)
    yield master
    master.close()


@pytest.fixture
def node_master(node_process: NodeMaster | AbsentMaster, station: Station) -> Iterator[NodeMaster | AbsentMaster]:
    """node-canopen as the master of drives that are fresh from the factory."""
    with station.open() as member:
        talk(RealLine(member), FACTORY)
        node_process.join(member)
        yield node_process


@pytest.fixture
def bench() -> Bench:
    """A drive in virtual time, booted, and without a heartbeat."""
    bench = Bench()
    assert bench.said == [(0, "701#00")]
    bench.said.clear()
    bench.prepare(QUIET)
    return bench
