"""Fuzzing guided by coverage: a process that `long_run.py` starts where atheris is installed.

python fuzz_coverage.py TARGET FRAMES SEED CORPUS RESULT
"""

import importlib
import json
import os
import random
import sys
from pathlib import Path
from typing import Final, NoReturn

import atheris
from fuzz_source import OctetSource

importlib.import_module("torquerig.device_sim.plant.rotor")  # as it is: numba does not take what atheris makes of it

with atheris.instrument_imports(include=["torquerig"]):
    from fuzz_session import TARGETS, Outcome

_LONGEST: Final = 16_384  # bytes of an input: some hundred frames
_BEGINNINGS: Final = 8


def main(target: str, frames: int, seed: int, corpus: Path, result: Path) -> None:
    """Fuzz until so many frames are through, or a session failed; write the result."""
    total = Outcome()

    def take(data: bytes) -> None:
        total.add(TARGETS[target](OctetSource(data)))
        if total.failure is not None or total.frames >= frames:
            _end(total, result)

    source = random.Random(seed)
    for number in range(_BEGINNINGS):
        (corpus / f"beginning-{seed}-{number}").write_bytes(source.randbytes(_LONGEST >> number))
    atheris.Setup([sys.argv[0], f"-seed={seed}", f"-max_len={_LONGEST}", "-len_control=0", str(corpus)], take)
    atheris.Fuzz()


def _end(total: Outcome, result: Path) -> NoReturn:
    report = total.failure.report if total.failure else ""
    told = {"frames": total.frames, "sessions": total.sessions, "seen": dict(total.seen), "report": report}
    result.write_text(json.dumps(told), "utf-8")
    os._exit(0)  # libFuzzer knows no other end than a crash


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]), Path(sys.argv[5]))
