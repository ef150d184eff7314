"""pytest plugin: tests marked `vcan` run where vcan0 and vcan1 are up, and are reported as if they ran here.

A parameter may be marked too. The tests are collected as all others are, by their own names, and come last; meanwhile a
second pytest runs them all in one guest (see launcher.py), beside the others. Its reports come back as they are:
outcome, text, captured output, durations. A test of which no report came back fails with what the guest said. Where
there is no place with vcan the tests are skipped, in one line with the reason; when the environment variable CI is set
they fail.
"""

import io
import json
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, NoReturn

import launcher
import pytest
from guest import TIME_LIMIT
from places import NoVcanError

REPORTS: Final = "VCAN_REPORTS"  # set for the pytest in the guest: the file for its reports
NOT_RUN: Final = "not run for want of vcan0: "
LIMIT_S: Final = 900.0
LAST_WORDS: Final = 3000  # [character]


def pytest_configure(config: pytest.Config) -> None:
    """Registers the one or the other side, once, however many conftest files ask for it."""
    if config.pluginmanager.has_plugin("vcan"):
        return
    config.addinivalue_line("markers", "vcan: the test needs vcan0 and vcan1: it runs in a guest that has them")
    reports = os.environ.pop(REPORTS, None)  # and no pytest that a test starts writes there
    config.pluginmanager.register(Forwarder(config) if reports is None else Reporter(config, Path(reports)), "vcan")


def unavailable(reason: str) -> NoReturn:
    """Skips the test for what this machine lacks, and fails it where nothing may be lacking."""
    if os.environ.get("CI", "").lower() not in {"", "0", "false"}:
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason)


def need(find: Callable[[], object]) -> None:
    """Calls what finds a place; where that raises NoVcanError, skips the test or fails it, always in the same words."""
    try:
        find()
    except NoVcanError as error:
        unavailable(f"{NOT_RUN}{error}")


class Reporter:
    """In the guest: writes down which test starts, and every report."""

    def __init__(self, config: pytest.Config, path: Path) -> None:
        self._config = config
        self._path = path

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Leaves word of the test, in case that it is the last."""
        self._write({"started": nodeid})

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Leaves the report."""
        self._write(self._config.hook.pytest_report_to_serializable(config=self._config, report=report))

    def _write(self, line: dict[str, Any]) -> None:
        with self._path.open("a") as file:
            file.write(json.dumps(line) + "\n")


class Forwarder:
    """Outside: puts a forwarded test in the place of each marked one, and the guest's reports in the place of ours."""

    def __init__(self, config: pytest.Config) -> None:
        self._guest = GuestRun(config)

    @pytest.hookimpl(trylast=True)  # after -k, -m and the like have chosen
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Replaces the marked tests, and puts them behind the others."""
        for place, item in enumerate(items):
            if item.get_closest_marker("vcan") and item.parent is not None:
                items[place] = ForwardedTest.from_parent(item.parent, name=item.name, here=item, guest=self._guest)
        items.sort(key=lambda item: isinstance(item, ForwardedTest))

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> None:
        """Has the guest begin with its tests while ours run."""
        names = [item.nodeid for item in session.items if isinstance(item, ForwardedTest)]
        if names and not session.config.option.collectonly:
            self._guest.start(names)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo[None]) -> pytest.TestReport | None:
        """Returns the guest's report if the test was run there."""
        return item.reports.get(call.when) if isinstance(item, ForwardedTest) else None


class ForwardedTest(pytest.Item):
    """A test that runs in the guest. Its reports, by phase, are there once it was set up."""

    def __init__(self, *, here: pytest.Item, guest: "GuestRun", **rest: Any) -> None:
        super().__init__(**rest)
        self._here = here
        self._guest = guest
        self.reports: dict[str, pytest.TestReport] = {}

    def setup(self) -> None:
        """Fetches the reports."""
        self.reports = self._guest.reports(self.nodeid)

    def runtest(self) -> None:
        """Does nothing: it was done in the guest."""

    def reportinfo(self) -> tuple[os.PathLike[str] | str, int | None, str]:
        """Returns where the test stands."""
        return self._here.reportinfo()


class GuestRun:
    """One guest for all forwarded tests of a session."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._thread: threading.Thread | None = None
        self._missing = ""
        self._trouble = "the guest was not started"
        self._reports: dict[str, dict[str, pytest.TestReport]] = {}

    def start(self, names: Sequence[str]) -> None:
        """Has the guest run the tests of these names; it ends with this process, if not before."""
        self._thread = threading.Thread(target=self._run, args=(names,), daemon=True)
        self._thread.start()

    def reports(self, name: str) -> dict[str, pytest.TestReport]:
        """Waits for the guest, and returns the test's reports by phase; skips or fails the test when there are none."""
        if self._thread is not None:
            self._thread.join()
        if self._missing:
            unavailable(self._missing)
        found = self._reports.get(name, {})
        if "teardown" not in found:  # the guest ended before the test did
            pytest.fail(self._trouble, pytrace=False)
        return found

    def _run(self, names: Sequence[str]) -> None:
        with tempfile.TemporaryDirectory(prefix="vcan-tests-") as name:
            folder = Path(name)
            (folder / "tests").write_text("\n".join(names))
            (folder / "reports").touch()
            output = io.BytesIO()
            try:
                status = launcher.run(
                    self._command(folder / "tests"),
                    limit_s=LIMIT_S,
                    writable=[folder, _kernel_cache(self._config.rootpath)],
                    environment={**os.environ, REPORTS: str(folder / "reports")},
                    cwd=self._config.rootpath,
                    output=output,
                    errors=output,
                )
            except NoVcanError as error:
                self._missing = f"{NOT_RUN}{error}"
                return
            lines = [json.loads(line) for line in (folder / "reports").read_text().splitlines()]
        started = [line["started"] for line in lines if "started" in line]
        self._trouble = _trouble(status, started[-1:], output.getvalue().decode(errors="replace"))
        for line in lines:
            if "started" not in line:
                report = self._restored(line)
                self._reports.setdefault(report.nodeid, {})[report.when] = report

    def _command(self, tests: Path) -> list[str]:
        ini = ["-c", str(self._config.inipath)] if self._config.inipath else []
        root = f"--rootdir={self._config.rootpath}"
        return [sys.executable, "-m", "pytest", *ini, root, "-p", "no:cacheprovider", "-q", f"@{tests}"]

    def _restored(self, line: dict[str, Any]) -> pytest.TestReport:
        report: pytest.TestReport
        report = self._config.hook.pytest_report_from_serializable(config=self._config, data=line)
        if isinstance(report.longrepr, list):  # a skip's file, line and reason: JSON knows no tuples
            path, number, reason = report.longrepr
            report.longrepr = (path, number, reason)
        return report


def _kernel_cache(root: Path) -> Path:
    """Returns the folder of compiled kernels, the guest's too: what one compiled serves the other, and later runs."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or root / "mechanism" / "__pycache__")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _trouble(status: int, last_started: Sequence[str], output: str) -> str:
    """Returns the text for a test of which the guest brought no report."""
    cause = f"time limit of {LIMIT_S:.0f} s" if status == TIME_LIMIT else f"exit status {status}"
    last = f"; the last test it started was {last_started[0]}" if last_started else ""
    return f"the guest ended without a report of this test ({cause}{last}); its last words:\n{output[-LAST_WORDS:]}"
