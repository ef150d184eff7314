"""The pseudo-terminal end: the link, hosts that come and go, hosts that do not read, times, closing."""

import os
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from adapter_host import Host, look, miss, take

from torquerig.driver.bus.slcan import BACKLOG, SlcanBus
from torquerig.driver.errors import BusError, BusUrlError
from torquerig.driver.wire.frame import Frame

OPEN = b"S8\rO\r"
FRAME = Frame(0x100, b"\x11\x33")
LINE = b"t10021133\r"
MANY = 20_000


class ManualClock:
    """A clock that shows what it is told to show."""

    def __init__(self) -> None:
        self.ns = 10**12

    def now_ns(self) -> int:
        return self.ns

    def wait_until(self, due_ns: int) -> None:
        self.ns = max(self.ns, due_ns)


@pytest.fixture
def host(bus: SlcanBus, link: Path) -> Iterator[Host]:
    """A host whose channel is open."""
    host = Host(link)
    host.say(OPEN)
    assert host.hear(2, lambda: look(bus)) == b"\r\r"
    yield host
    host.leave()


class TestLink:
    def test_it_leads_to_the_port_and_goes_with_the_bus(self, bus: SlcanBus, link: Path) -> None:
        assert str(link.readlink()) == bus.port
        assert Path(bus.port).is_char_device()
        bus.close()
        assert not link.is_symlink()
        bus.close()

    def test_one_left_over_that_leads_nowhere_is_replaced(self, link: Path) -> None:
        link.symlink_to("/dev/pts/987654")
        bus = SlcanBus(link, bitrate=1_000_000)
        assert str(link.readlink()) == bus.port
        bus.close()

    def test_one_left_over_that_leads_to_the_same_terminal_is_replaced(
        self, link: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        openpty = os.openpty

        def open_the_one_that_a_killed_simulator_had() -> tuple[int, int]:
            ends = openpty()
            link.symlink_to(os.ttyname(ends[1]))
            return ends

        monkeypatch.setattr(os, "openpty", open_the_one_that_a_killed_simulator_had)
        bus = SlcanBus(link, bitrate=1_000_000)
        assert str(link.readlink()) == bus.port
        bus.close()

    @pytest.mark.parametrize("kind", ["file", "folder", "link", "simulator"])
    def test_nothing_else_is_overwritten_and_one_sentence_says_so(self, link: Path, kind: str) -> None:
        other = None
        if kind == "file":
            link.write_text("kept")
        elif kind == "folder":
            link.mkdir()
        elif kind == "link":
            link.symlink_to("/dev/null")
        else:
            other = SlcanBus(link, bitrate=1_000_000)
        before = os.lstat(link)
        with pytest.raises(BusUrlError, match=r"ttyRIG cannot become a serial port: it exists, and not as a link"):
            SlcanBus(link, bitrate=1_000_000)
        assert os.lstat(link) == before
        if other:
            other.close()

    def test_a_folder_that_is_not_there_is_told_in_one_sentence(self, tmp_path: Path) -> None:
        with pytest.raises(BusUrlError, match=r"none/ttyRIG cannot become a serial port: No such file or directory$"):
            SlcanBus(tmp_path / "none" / "ttyRIG", bitrate=1_000_000)

    def test_refusals_leave_no_descriptor_behind(self, link: Path) -> None:
        link.write_text("kept")
        before = len(os.listdir("/proc/self/fd"))
        for _ in range(3):
            with pytest.raises(BusUrlError):
                SlcanBus(link, bitrate=1_000_000)
        assert len(os.listdir("/proc/self/fd")) == before

    def test_a_link_that_is_no_longer_ours_stays(self, bus: SlcanBus, link: Path) -> None:
        link.unlink()
        link.symlink_to("/dev/null")
        bus.close()
        assert str(link.readlink()) == "/dev/null"


class TestHost:
    def test_frames_pass_both_ways_in_order(self, bus: SlcanBus, host: Host) -> None:
        host.say(b"t10021133\rr1230\rT12ABCDEF2AA55\r")
        assert take(bus, 3) == [FRAME, Frame(0x123, remote=True), Frame(0x12ABCDEF, b"\xaa\x55", extended=True)]
        bus.send(FRAME)
        bus.send(Frame(0x123, remote=True))
        assert host.hear(22, lambda: None) == b"z\rz\rZ\rt10021133\rr1230\r"

    def test_garbage_gets_a_bell_and_what_follows_is_understood(self, bus: SlcanBus, host: Host) -> None:
        host.say(bytes(range(256)) + b"\r" + LINE)
        assert take(bus, 1) == [FRAME]
        assert bus.counts == {"garbage": 2}  # the one carriage return among the 256 ends a line, too
        assert host.hear(4, lambda: look(bus)) == b"\a\az\r"

    def test_the_port_is_raw(self, host: Host) -> None:
        input_flags, output_flags, _, local_flags, *_ = termios.tcgetattr(host.descriptor)
        assert not input_flags & (termios.ICRNL | termios.IXON)
        assert not output_flags & termios.OPOST
        assert not local_flags & (termios.ECHO | termios.ICANON | termios.ISIG)

    def test_it_may_go_and_come_again_and_finds_nothing_of_before(self, bus: SlcanBus, link: Path) -> None:
        for _ in range(3):
            host = Host(link)
            host.say(b"S8\rO\r" + LINE + b"t100211")
            assert take(bus, 1) == [FRAME]
            bus.send(FRAME)  # which this host does not read
            settings = termios.tcgetattr(host.descriptor)
            settings[3] |= termios.ECHO | termios.ICANON
            termios.tcsetattr(host.descriptor, termios.TCSANOW, settings)
            host.leave()
            miss(bus)
            bus.send(FRAME)
            host = Host(link)
            assert look(bus) is None
            assert not termios.tcgetattr(host.descriptor)[3] & (termios.ECHO | termios.ICANON)
            host.say(b"C\r")
            assert host.hear(1, lambda: look(bus)) == b"\r"
            host.leave()
            miss(bus)
        assert bus.counts == {"unheard": 3}

    def test_it_finds_nothing_of_the_much_that_one_before_did_not_read(self, bus: SlcanBus, link: Path) -> None:
        host = Host(link)
        host.say(OPEN + LINE)
        assert take(bus, 1) == [FRAME]
        for _ in range(1000):  # more than the terminal's line discipline takes from its driver
            bus.send(FRAME)
        host.leave()
        miss(bus)
        host = Host(link)
        host.say(b"C\r")
        assert host.hear(1, lambda: look(bus)) == b"\r"
        host.leave()

    def test_what_it_said_before_it_went_is_heard(self, bus: SlcanBus, link: Path) -> None:
        host = Host(link)
        host.say(OPEN + LINE)
        host.leave()
        assert take(bus, 1) == [FRAME]

    def test_a_wait_without_a_host_ends_in_time_and_takes_no_processor(self, bus: SlcanBus) -> None:
        began, used = time.monotonic_ns(), time.process_time_ns()
        assert bus.receive(bus.now_ns() + 300_000_000) is None
        assert time.monotonic_ns() - began >= 300_000_000
        assert time.process_time_ns() - used < 100_000_000

    def test_frames_without_a_host_are_no_error_and_counted(self, bus: SlcanBus) -> None:
        for _ in range(5):
            bus.send(FRAME)
        assert bus.counts == {"unheard": 5}


class TestHostThatDoesNotRead:
    def test_it_blocks_nobody_and_what_it_loses_is_counted(self, bus: SlcanBus, host: Host) -> None:
        for number in range(MANY):
            bus.send(Frame(0x200, number.to_bytes(4, "big")))
        lost = bus.counts["overrun"]
        assert 0 < lost < MANY
        assert len(bus._backlog) <= BACKLOG
        heard = host.hear((MANY - lost) * len("t200411223344\r"), lambda: look(bus))
        numbers = [int(line[5:], 16) for line in heard.split(b"\r")[:-1]]
        assert numbers == list(range(MANY - lost))  # every line whole, in order, and the oldest kept
        host.say(b"F\r")
        assert host.hear(4, lambda: look(bus)) == b"F09\r"

    def test_its_own_frames_still_pass(self, bus: SlcanBus, host: Host) -> None:
        for _ in range(MANY):
            bus.send(FRAME)
        for _ in range(100):
            host.say(LINE)
            assert take(bus, 1) == [FRAME]


class TestTimes:
    def test_a_frame_is_stamped_when_it_is_seen(self, bus: SlcanBus, host: Host) -> None:
        before_ns = bus.now_ns()
        host.say(LINE)
        arrival = bus.receive(bus.now_ns() + 10**9)
        assert arrival is not None
        assert before_ns <= arrival.at_ns <= bus.now_ns()

    def test_what_waits_comes_first_though_the_deadline_is_past(self, bus: SlcanBus, host: Host) -> None:
        host.say(LINE * 3)
        arrivals = [bus.receive(0) for _ in range(3)]
        assert all(arrivals)
        assert bus.receive(0) is None

    def test_what_came_during_a_stall_is_spread_over_it(self, link: Path) -> None:
        clock = ManualClock()
        bus = SlcanBus(link, bitrate=1_000_000, clock=clock)
        host = Host(link)
        host.say(OPEN)
        assert bus.receive(clock.ns) is None
        host.say(LINE * 4)
        due_ns = clock.ns + 1_000_000
        clock.ns += 20_000_000
        arrivals = [bus.receive(due_ns) for _ in range(4)]
        times = [clock.ns - arrival.at_ns for arrival in arrivals if arrival is not None]
        assert times == [15_000_000, 10_000_000, 5_000_000, 0]
        host.leave()
        bus.close()

    def test_what_came_together_without_a_stall_came_now(self, link: Path) -> None:
        clock = ManualClock()
        bus = SlcanBus(link, bitrate=1_000_000, clock=clock)
        host = Host(link)
        host.say(OPEN)
        assert bus.receive(clock.ns) is None
        host.say(LINE * 2)
        clock.ns += 20_000_000
        arrivals = [bus.receive(clock.ns + 1) for _ in range(2)]
        assert [arrival.at_ns for arrival in arrivals if arrival is not None] == [clock.ns, clock.ns]
        host.leave()
        bus.close()


def test_the_tap_is_told_what_passes_on_the_bus_whether_the_host_hears_it_or_not(link: Path) -> None:
    log: list[Frame] = []
    bus = SlcanBus(link, bitrate=1_000_000, tap=lambda _, frame: log.append(frame))
    bus.send(Frame(0x701, b"\x00"))
    host = Host(link)
    host.say(OPEN + LINE)
    assert take(bus, 1) == [FRAME]
    assert log == [Frame(0x701, b"\x00"), FRAME]
    host.leave()
    bus.close()


def test_what_is_no_classic_frame_is_refused(bus: SlcanBus) -> None:
    with pytest.raises(ValueError, match="identifier 0x800"):
        bus.send(Frame(0x800))


def test_a_closed_bus_refuses_and_its_host_is_hung_up(bus: SlcanBus, host: Host) -> None:
    bus.close()
    for use in (lambda: bus.send(FRAME), lambda: bus.receive(0)):
        with pytest.raises(BusError, match="ttyRIG is closed"):
            use()
    with pytest.raises(OSError, match="Input/output error"):
        host.say(LINE)
