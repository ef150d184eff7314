"""Every procedure on many rigs over the simulated wire, which does not belong into CI.

    python tests/calibration/long_run.py --rigs 20 --seed 1
    python tests/calibration/long_run.py --rigs 5 --seed 6 --only zeros --keep runs.jsonl    # 5 more

The table says in which share of the cases the interval of 95 % held the truth, and what was missed by most.
"""

import argparse
import json
import math
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from varied_rigs import TRIALS, Found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; the exit code, which is 1 when a procedure did not end as it should."""
    options = _parser().parse_args(arguments)
    lines = [json.loads(line) for line in _kept(options.keep)]
    done = {(line["procedure"], line["seed"]) for line in lines}
    failed = 0
    for name in options.only or TRIALS:
        for seed in range(options.seed, options.seed + options.rigs):
            if (name, seed) in done:
                continue
            line, error = _run(name, seed)
            failed += error is not None
            _say(f"{name} {seed}: {error or len(line['found'])}")
            if error is None:
                lines.append(line)
                _keep(options.keep, line)
    for row in table(lines):
        _say(row)
    return int(failed > 0)


def table(lines: Iterable[dict[str, Any]]) -> list[str]:
    """The results as a table in Markdown."""
    grouped: dict[tuple[str, str], list[Found]] = defaultdict(list)
    rigs: dict[str, set[int]] = defaultdict(set)
    for line in lines:
        rigs[line["procedure"]].add(line["seed"])
        for each in line["found"]:
            found = Found(*each)
            name = "named as it is" if line["procedure"] == "direction" else found.name
            grouped[line["procedure"], name].append(found)
    rows = ["| procedure | value | rigs | values | covered | worst error |", "| --- | --- | --- | --- | --- | --- |"]
    for (procedure, name), found in grouped.items():
        bounded = [each for each in found if not math.isnan(each.low)]
        covered = f"{100 * sum(each.is_covered for each in bounded) / len(bounded):.0f} %" if bounded else "-"
        worst = max(abs(each.value - each.truth) for each in found)
        if procedure == "direction":
            covered, worst = f"{sum(each.value for each in found):.0f} of {len(found)}", 0.0
        error = f"{worst:.2g}" if worst else "-"
        rows.append(f"| {procedure} | {name} | {len(rigs[procedure])} | {len(found)} | {covered} | {error} |")
    return rows


def _run(name: str, seed: int) -> tuple[dict[str, Any], str | None]:
    """One procedure on one rig: what it found, or what ended it."""
    try:
        return {"procedure": name, "seed": seed, "found": TRIALS[name](seed).run()}, None
    except Exception as error:  # noqa: BLE001  (whatever it is, the other rigs are run)
        return {}, f"{type(error).__name__}: {error}"


def _kept(path: Path | None) -> list[str]:
    return path.read_text("utf-8").splitlines() if path is not None and path.exists() else []


def _keep(path: Path | None, line: dict[str, Any]) -> None:
    if path is not None:
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rigs", type=int, default=20, help="how many of each procedure")
    parser.add_argument("--seed", type=int, default=1, help="of the first rig")
    parser.add_argument("--only", action="append", choices=list(TRIALS), help="this procedure; may be given again")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="JSON lines to add to; what is there is not run")
    return parser


if __name__ == "__main__":
    sys.exit(main())
