"""A long run of fuzzing, which does not belong into CI.

    python tests/fuzz/long_run.py --frames 1000000 --seed 1
    python tests/fuzz/long_run.py --target driver --engine random
    python tests/fuzz/long_run.py --replay failure.log

With atheris in the environment (`pip install atheris`; it is no dependency of the project) the inputs are guided by the
coverage of torquerig's code, else they come from the seed alone. A failure is printed with a log in candump's format.
"""

import argparse
import importlib.util
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from fuzz_log import load
from fuzz_session import TARGETS, Outcome, play
from fuzz_source import SeededSource

_KIB_A_MIB: Final = 1024
_TOLD_S: Final = 60.0  # from one line of progress to the next


class Totals(NamedTuple):
    """What a run came to.

    Attributes:
        frames: Frames or messages given to the target.
        sessions: In so many sessions.
        seen: What was refused, or which errors ended an action, by kind.
        report: Why it failed; empty when it did not.
        remark: What the engine says of itself.
    """

    frames: int
    sessions: int
    seen: dict[str, int]
    report: str = ""
    remark: str = ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; the exit code, which is 1 when something failed."""
    options = _parser().parse_args(arguments)
    if options.replay:
        error = play(load(options.replay), options.plan.split())
        _say(error or "nothing went wrong")
        return int(error is not None)
    targets = list(TARGETS) if options.target == "all" else [options.target]
    return max([_run(target, options) for target in targets])


def seeded(target: str, frames: int, seed: int) -> Totals:
    """Sessions by the seed until so many frames are through, or one failed."""
    total, told_s = Outcome(), time.monotonic()
    while total.frames < frames and total.failure is None:
        total.add(TARGETS[target](SeededSource(f"{target} {seed} {total.sessions}")))
        if time.monotonic() - told_s > _TOLD_S:
            told_s = time.monotonic()
            _say(f"  {total.frames} frames, {total.sessions} sessions, {_peak_mib(resource.RUSAGE_SELF)} MiB")
    report = total.failure.report if total.failure else ""
    return Totals(total.frames, total.sessions, dict(total.seen), report)


def guided(target: str, frames: int, seed: int, corpus: Path | None) -> Totals:
    """The same by atheris, in a process of its own, because libFuzzer ends the one that it is in.

    Raises:
        RuntimeError: It ended without a result.
    """
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.json"
        place = corpus or Path(folder) / "corpus"
        place.mkdir(parents=True, exist_ok=True)
        script = str(Path(__file__).with_name("fuzz_coverage.py"))
        command = [sys.executable, script, target, str(frames), str(seed), str(place), str(result)]
        run = subprocess.run(command, check=False, stderr=subprocess.PIPE, text=True)
        if not result.is_file():
            raise RuntimeError(f"{' '.join(command)} ended with {run.returncode}:\n{run.stderr[-3000:]}")
        progress = [line.strip() for line in run.stderr.splitlines() if " cov: " in line]
        return Totals(**json.loads(result.read_text("utf-8")), remark=progress[-1] if progress else "")


def _run(target: str, options: argparse.Namespace) -> int:
    engine = options.engine
    if engine == "auto":
        engine = "atheris" if importlib.util.find_spec("atheris") else "random"
    _say(f"{target}: {options.frames} frames by the engine {engine}, seed {options.seed}")
    began_s = time.monotonic()
    if engine == "atheris":
        totals = guided(target, options.frames, options.seed, options.corpus)
    else:
        totals = seeded(target, options.frames, options.seed)
    took_s = time.monotonic() - began_s
    peak = max(_peak_mib(resource.RUSAGE_SELF), _peak_mib(resource.RUSAGE_CHILDREN))
    _say(f"  {totals.frames} frames in {totals.sessions} sessions, {took_s:.0f} s, {peak} MiB at most")
    for line in (json.dumps(totals.seen), totals.remark, totals.report):
        if line:
            _say(f"  {line}")
    return int(bool(totals.report))


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _peak_mib(who: int) -> int:
    return resource.getrusage(who).ru_maxrss // _KIB_A_MIB


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--target", choices=["all", *TARGETS], default="all")
    parser.add_argument("--frames", type=int, default=1_000_000, help="how many at least, of each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--engine", choices=["auto", "random", "atheris"], default="auto")
    parser.add_argument("--corpus", type=Path, help="a folder of inputs for atheris, to begin with and to add to")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="a log of candump -L for drives or driver")
    parser.add_argument("--plan", default="", help="with --replay: what the driver does, as the failure told it")
    return parser


if __name__ == "__main__":
    sys.exit(main())
