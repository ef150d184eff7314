"""The first process (pid 1) of a place with CAN links of its own: runs one command there and leaves its status.

Started by the launcher as `python guest.py FOLDER`, in a User-Mode Linux or in namespaces of the host's kernel. The
folder holds the job; in it the guest leaves `stdout` and `stderr` of the command while it runs, then `status`.
"""

import json
import os
import signal
import subprocess
import sys
import threading
import time
import traceback
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import links
import machine

TIME_LIMIT: Final = 124  # statuses as coreutils' timeout and the shell have them
GUEST_FAILED: Final = 125
NOT_EXECUTABLE: Final = 126
NOT_FOUND: Final = 127
KILLED: Final = 128

GRACE_S: Final = 3.0  # between SIGTERM and SIGKILL at the time limit


@dataclass(frozen=True, slots=True)
class Job:
    """What to run, and how the command's world is to look.

    Attributes:
        command: Program and arguments.
        environment: All of the command's environment variables.
        cwd: Working folder.
        umask: File mode creation mask.
        limit_s: Time limit [s].
        links: Number of links vcan0, vcan1 ... that are up when the command starts.
        modules: Kernel modules to load, in order; None where kernel and files are the host's and all is there.
        writable: Folders whose files are the host's own; all else that is written stays in the guest.
    """

    command: list[str]
    environment: dict[str, str]
    cwd: str
    umask: int
    limit_s: float
    links: int
    modules: list[str] | None
    writable: list[str]

    def save(self, folder: Path) -> None:
        """Leaves the job where the guest looks for it."""
        (folder / "job.json").write_text(json.dumps(asdict(self)))

    @classmethod
    def load(cls, folder: Path) -> "Job":
        """Returns the job the launcher left."""
        return cls(**json.loads((folder / "job.json").read_text()))


def main(folder: Path) -> None:
    """Does the folder's job, then ends the guest."""
    if os.getpid() != 1:  # or the time limit would kill every process of the machine
        raise SystemExit("guest.py is the first process of a guest: start it by launcher.py")
    job = Job.load(folder)
    status = GUEST_FAILED
    try:
        if job.modules is not None:
            machine.furnish(job.modules, job.writable)
        links.switch("lo", up=True)
        for number in range(job.links):
            links.add(f"vcan{number}")
            links.switch(f"vcan{number}", up=True)
        status = run(job, folder)
    except Exception:  # noqa: BLE001 whatever it was, the launcher must hear of it
        with (folder / "stderr").open("a") as errors:
            traceback.print_exc(file=errors)
    unfinished = folder / "status.unfinished"
    unfinished.write_text(str(status))
    unfinished.replace(folder / "status")
    if job.modules is not None:
        machine.power_off()


def run(job: Job, folder: Path) -> int:
    """Runs the command to its end and returns its status.

    Its streams are files, not pipes: User-Mode Linux has no lossless road out of the guest but the file system.
    """
    with (folder / "stdout").open("ab") as output, (folder / "stderr").open("ab") as errors:
        try:
            process = subprocess.Popen(
                job.command,
                env=job.environment,
                cwd=job.cwd,
                umask=job.umask,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                start_new_session=True,
            )
        except OSError as error:
            errors.write(f"{error}\n".encode())
            return NOT_FOUND if isinstance(error, FileNotFoundError) else NOT_EXECUTABLE
    return _await(process.pid, job.limit_s)


def _await(pid: int, limit_s: float) -> int:
    """Waits for the process, reaping orphans meanwhile as the first process must."""
    late = threading.Event()

    def end_all() -> None:
        late.set()
        with suppress(ProcessLookupError):
            os.kill(-1, signal.SIGTERM)  # all but the first process
            time.sleep(GRACE_S)
            os.kill(-1, signal.SIGKILL)

    timer = threading.Timer(limit_s, end_all)
    timer.daemon = True
    timer.start()
    child = status = 0
    while child != pid:
        child, status = os.wait()
    timer.cancel()
    if late.is_set():
        return TIME_LIMIT
    code = os.waitstatus_to_exitcode(status)
    return code if code >= 0 else KILLED - code


if __name__ == "__main__":
    main(Path(sys.argv[1]))
