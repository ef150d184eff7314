"""What a freshly booted User-Mode Linux lacks: modules, and a root file system that may be written.

The host's root is mounted read-only at boot (hostfs). Over it comes an overlay whose upper layer lives in the guest's
memory: everything may be written, nothing reaches the host, except below the folders mounted from it once more.
"""

import ctypes
import errno
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

FINIT_MODULE: Final = 313  # x86-64, the only architecture of User-Mode Linux besides its 32-bit elder
POWER_OFF: Final = 0x4321FEDC  # linux/reboot.h
LAYERS: Final = Path("/mnt")
ROOT: Final = LAYERS / "root"

_libc: Final = ctypes.CDLL(None, use_errno=True)


def furnish(modules: Iterable[str], writable: Iterable[str]) -> None:
    """Loads the modules, mounts what programs expect, and moves this process into the overlay."""
    for module in modules:
        _load(module)
    _mount("tmpfs", LAYERS)
    for layer in ("upper", "work", "root"):
        (LAYERS / layer).mkdir()
    _mount("overlay", ROOT, f"lowerdir=/,upperdir={LAYERS / 'upper'},workdir={LAYERS / 'work'}")
    for kind, folder, options in (
        ("proc", "proc", ""),
        ("sysfs", "sys", ""),
        ("devtmpfs", "dev", ""),
        ("devpts", "dev/pts", "ptmxmode=666"),
        ("tmpfs", "dev/shm", "mode=1777"),
        ("tmpfs", "run", ""),
    ):
        _mount(kind, ROOT / folder, options)
    for link, target in (("fd", "fd"), ("stdin", "fd/0"), ("stdout", "fd/1"), ("stderr", "fd/2")):
        (ROOT / "dev" / link).symlink_to(f"/proc/self/{target}")
    for folder in writable:
        _mount("hostfs", ROOT / folder.lstrip("/"), folder)
    os.chroot(ROOT)
    os.chdir("/")


def power_off() -> None:
    """Ends the guest at once."""
    _libc.reboot(POWER_OFF)


def _load(module: str) -> None:
    with open(module, "rb") as file:
        if _libc.syscall(FINIT_MODULE, file.fileno(), b"", 0) and ctypes.get_errno() != errno.EEXIST:
            _raise(f"loading {module}")


def _mount(kind: str, folder: Path, options: str = "") -> None:
    folder.mkdir(exist_ok=True)
    if _libc.mount(kind.encode(), os.fsencode(folder), kind.encode(), 0, os.fsencode(options)):
        _raise(f"mounting {kind} on {folder}")


def _raise(doing: str) -> None:
    number = ctypes.get_errno()
    raise OSError(number, os.strerror(number), doing)
