"""The launcher: what its command sees and leaves, its time limit, and that nothing of it stays behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import launcher
import pytest
from forward import need
from guest import NOT_EXECUTABLE, NOT_FOUND, TIME_LIMIT
from places import HERE
from uml import Uml

LIMIT_S = 60.0
PATIENCE_S = 120.0


# both kinds of place; the native one inside of whichever this machine has, for there the kernel has vcan
each_place = pytest.mark.parametrize("place", ["uml", pytest.param("native", marks=pytest.mark.vcan)])


def need_place(name: str) -> None:
    """To be called by the test itself, not by a fixture: then pytest folds all such skips into one line."""
    if name == "uml":
        need(launcher.find_place)
        need(boot_once)


@cache
def boot_once() -> None:
    """Raises NoVcanError if User-Mode Linux is not installed or does not boot here."""
    launcher.run(["true"], place=Uml.find(), limit_s=LIMIT_S)


def command_line(place: str, *command: str, options: tuple[str, ...] = ()) -> list[str]:
    return [sys.executable, str(HERE / "launcher.py"), "--place", place, "-t", str(LIMIT_S), *options, "--", *command]


def shell(place: str, script: str, *options: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Runs the script to its end."""
    line = command_line(place, "sh", "-c", script, options=options)
    environment = {**os.environ, "GREETING": "two words; $HOME 'ü'"}
    return subprocess.run(
        line, cwd=cwd, env=environment, umask=0o027, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )


def await_true(what: str, condition: Callable[[], object]) -> None:
    until = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < until, f"waited in vain: {what}"
        time.sleep(0.05)


@each_place
def test_command_keeps_its_world_and_its_end(place: str, tmp_path: Path) -> None:
    need_place(place)
    folder = tmp_path / "a folder"
    folder.mkdir()
    script = 'pwd; umask; echo "$GREETING"; cat; cat /proc/net/dev; echo "$LD_PRELOAD" >&2; kill -TERM $$'
    done = shell(place, script, "-n", "3", cwd=folder)
    told = done.stdout.splitlines()
    assert told[:3] == [str(folder), "0027", "two words; $HOME 'ü'"]
    assert {"lo:", "vcan0:", "vcan1:", "vcan2:"} <= {line.split()[0] for line in told[3:]}
    assert (done.stderr.strip(), done.returncode) == (os.environ.get("LD_PRELOAD", ""), 128 + signal.SIGTERM)


@pytest.mark.vcan
@pytest.mark.parametrize(("program", "status"), [("./missing", NOT_FOUND), ("/etc/passwd", NOT_EXECUTABLE)])
def test_command_that_cannot_start_is_told_by_the_shells_statuses(program: str, status: int) -> None:
    done = subprocess.run(command_line("native", program), capture_output=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == status
    assert program.encode() in done.stderr


@pytest.mark.vcan
def test_command_is_ended_at_its_time_limit_and_what_it_said_is_kept(tmp_path: Path) -> None:
    script = "echo before; trap '' TERM; while :; do sleep 1; done"
    done = shell("native", script, "-t", "1", cwd=tmp_path)
    assert (done.stdout, done.returncode) == ("before\n", TIME_LIMIT)


def test_guest_writes_what_it_likes_and_the_host_sees_only_the_shared_folders(tmp_path: Path) -> None:
    need_place("uml")
    shared = tmp_path / "shared"
    shared.mkdir()
    (tmp_path / "kept").write_text("host")
    script = "echo guest > kept && echo guest > new && echo guest > shared/new && cat kept new shared/new"
    done = shell("uml", script, "-w", str(shared), cwd=tmp_path)
    assert (done.stdout, done.returncode) == ("guest\nguest\nguest\n", 0)
    assert (tmp_path / "kept").read_text() == "host"
    assert not (tmp_path / "new").exists()
    assert (shared / "new").read_text() == "guest\n"


def test_guest_that_never_starts_is_explained_in_one_line() -> None:
    dies = "Checking that ptrace can change system call numbers...OK\nptrace set fp regs failed, errno = 14\nAborted\n"
    assert Uml(()).why_not_started(dies).endswith("(apt install gcc libc6-dev)")
    assert Uml(()).why_not_started("Kernel panic: no init\n [<60>] trace\n") == (
        "linux.uml does not boot here: Kernel panic: no init"
    )
    assert Uml(()).why_not_started("") == "linux.uml does not boot here: nothing was printed"


@contextmanager
def running(place: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A launcher whose guest has said a line, with a process in a session of its own beside it."""
    line = command_line(place, "sh", "-c", "setsid sleep 3000 & echo running; exec sleep 3000")
    environment = {**os.environ, "TMPDIR": str(folder)}
    with subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, text=True, process_group=0) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "running\n"
            yield process
        finally:
            process.kill()


def descendants(pid: int) -> set[int]:
    """Process ids of all that stand below the process, as this process namespace numbers them."""
    found: set[int] = set()
    unseen = [pid]
    while unseen:
        for children in Path("/proc", str(unseen.pop()), "task").glob("*/children"):
            new = [int(word) for word in children.read_text().split()]
            found.update(new)
            unseen.extend(new)
    return found


def lives(pid: int) -> bool:
    """Whether the process runs; a zombie does not."""
    try:
        return Path("/proc", str(pid), "stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


@each_place
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=lambda number: number.name)
def test_nothing_of_the_guest_outlives_the_launcher(place: str, tmp_path: Path, number: signal.Signals) -> None:
    need_place(place)
    with running(place, tmp_path) as process:
        guest = descendants(process.pid)
        assert len(guest) >= 3
        assert any(tmp_path.iterdir())
        if number is signal.SIGINT:
            os.killpg(process.pid, number)  # as the terminal sends Ctrl-C to all it has in front
        else:
            process.send_signal(number)
        process.wait(PATIENCE_S)
        await_true("the end of the guest's processes", lambda: not any(map(lives, guest)))
        await_true("the end of the guest's files", lambda: not any(tmp_path.iterdir()))
