"""The host's own kernel as a place with CAN links: namespaces in which vcan0 is nobody else's.

A network namespace keeps the user's own links out of reach of tests that take links down; a process namespace ends
all that the command leaves behind.
"""

import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from places import HERE, INTERPRETER, NoVcanError, first_process, last_line

NAMESPACES: Final = ("--net", "--pid", "--fork", "--kill-child=KILL", "--mount-proc")
PROBE: Final = "import links; links.add('vcan0')"
PROBE_LIMIT_S: Final = 30.0


@dataclass(frozen=True, slots=True)
class Native:
    """Namespaces made by util-linux' unshare."""

    unshare: tuple[str, ...]
    modules: None = None

    @classmethod
    def find(cls) -> "Native":
        """Returns the place after having made a link there, which tells more than any look at the kernel.

        Raises:
            NoVcanError: The kernel has no vcan, or this user may not make namespaces.
        """
        program = shutil.which("unshare")
        if program is None:
            raise NoVcanError("no unshare (apt install util-linux)")
        user = () if os.geteuid() == 0 else ("--user", "--map-root-user")
        unshare = (program, *user, *NAMESPACES, "--")
        try:
            probe = subprocess.run(
                [*unshare, *INTERPRETER, "-c", PROBE],
                cwd=HERE,
                capture_output=True,
                text=True,
                timeout=PROBE_LIMIT_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise NoVcanError("this kernel took too long over a vcan link") from None
        if probe.returncode:
            raise NoVcanError(f"this kernel gives us no vcan ({last_line(probe.stderr)})")
        return cls(unshare)

    def prepare(self, folder: Path) -> Mapping[str, str]:
        """Needs nothing."""
        del folder
        return {}

    def command_line(self, folder: Path) -> Sequence[str]:
        """Returns the first process' command line, in the namespaces."""
        return (*self.unshare, *first_process(folder))

    def why_not_started(self, console: str) -> str:
        """Returns unshare's complaint."""
        return f"namespaces cannot be made any more: {last_line(console)}"
