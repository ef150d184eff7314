"""User-Mode Linux as a place with CAN links: a kernel that is an ordinary program of Debian's `user-mode-linux`.

It needs no right but ptrace and no CAN in the host's kernel, boots in some three seconds and takes about 100 MB.
"""

import os
import shlex
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from places import HERE, NoVcanError, first_process, last_line

PROGRAM: Final = Path("/usr/bin/linux.uml")
MODULES: Final = Path("/usr/lib/uml/modules")
WANTED: Final = (  # in the order of their needs; what a kernel has built in has no file
    "net/can/can",
    "net/can/can-raw",
    "net/can/can-bcm",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
    "drivers/net/can/slcan/slcan",
    "fs/overlayfs/overlay",
)
MEMORY: Final = 1 << 30  # [byte], taken only as far as it is used
COMPILER_LIMIT_S: Final = 60.0
REAL_TIME: Final = ("chrt", "--fifo", "5")  # what runs in real time in the guest does so only if the guest itself does
STATE_TOO_LARGE: Final = "ptrace set fp regs failed"  # what UML 6.1 says and dies: see xstate.c


@dataclass(frozen=True, slots=True)
class Uml:
    """A kernel to be booted, and its modules."""

    modules: tuple[str, ...]

    @classmethod
    def find(cls) -> "Uml":
        """Returns the place if Debian's package is installed; whether it boots here, only a boot can tell.

        Raises:
            NoVcanError: It is not.
        """
        kernels = sorted(MODULES.glob("*/kernel"))
        if not (PROGRAM.exists() and kernels):
            raise NoVcanError("no User-Mode Linux (apt install user-mode-linux)")
        files = (kernels[-1] / f"{name}.ko" for name in WANTED)
        return cls(tuple(str(file) for file in files if file.exists()))

    def prepare(self, folder: Path) -> Mapping[str, str]:
        """Writes the init script, and builds the shim where there is a compiler."""
        init = folder / "init"
        init.write_text(f"#!/bin/sh\nexec {shlex.join(first_process(folder))}\n")
        init.chmod(0o755)
        environment = {"TMPDIR": _memory_folder(folder)}
        shim = _build_shim(folder)
        return environment if shim is None else {**environment, "LD_PRELOAD": shim}

    def command_line(self, folder: Path) -> Sequence[str]:
        """Returns the kernel's command line: its root the host's, its console what the start prints."""
        return (
            *(REAL_TIME if _may(REAL_TIME) else ()),
            str(PROGRAM),
            f"mem={MEMORY}",
            *("root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro"),
            f"init={folder}/init",
            *(f"uml_dir={folder}/", "umid=guest"),
            *("con0=null,fd:1", "con=null", "ssl=null"),
            *("panic=-1", "noreboot", "quiet", "loglevel=4", "random.trust_cpu=on"),
        )

    def why_not_started(self, console: str) -> str:
        """Returns what is missing, or the kernel's last words."""
        if STATE_TOO_LARGE in console:
            return (
                "linux.uml boots on this processor only with the help of xstate.c, and no C compiler could build that "
                "(apt install gcc libc6-dev)"
            )
        panic = [line.strip() for line in console.splitlines() if "Kernel panic" in line]
        return f"linux.uml does not boot here: {panic[0] if panic else last_line(console)}"


def _may(prefix: Sequence[str]) -> bool:
    """Returns whether a command may be started with this prefix."""
    if shutil.which(prefix[0]) is None:
        return False
    tried = subprocess.run([*prefix, "true"], capture_output=True, timeout=COMPILER_LIMIT_S, check=False)
    return tried.returncode == 0


def _memory_folder(folder: Path) -> str:
    """Returns where the guest's memory, a sparse file, is quickest: no noexec mount, and large enough."""
    shared = Path("/dev/shm")  # noqa: S108 the kernel makes a file of a name of its own, and unlinks it
    if shared.is_dir() and os.access(shared, os.W_OK):
        state = os.statvfs(shared)
        if not state.f_flag & os.ST_NOEXEC and state.f_bavail * state.f_frsize >= MEMORY:
            return str(shared)
    return str(folder)


def _build_shim(folder: Path) -> str | None:
    """Returns the shim built in the folder, or None when there is no compiler that can: often it boots without."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    shim = folder / "xstate.so"
    command = (compiler, "-shared", "-fPIC", "-O2", "-o", str(shim), str(HERE / "xstate.c"), "-ldl")
    built = subprocess.run(command, capture_output=True, timeout=COMPILER_LIMIT_S, check=False)
    return None if built.returncode else str(shim)
