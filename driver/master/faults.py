"""Faults: learned from statusword, error code and history, told in words, reset when they are nobody's fault any more.

A controller that was killed leaves its drives in communication faults (0x8250, 0x8130, 0x8700, and 0xFF01 in the
siblings). Those are reset, and named, by the next one. Any other fault is a person's to look at.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from torquerig.driver.errors import DriveFault
from torquerig.driver.master.axis import DISABLED_STATES
from torquerig.driver.master.pump import MILLISECOND_NS, name_drives
from torquerig.driver.master.sdo_jobs import NUMBER_BYTES, Download, Job, Pause, SdoService, Upload
from torquerig.driver.master.watch import describe_code
from torquerig.driver.wire import emcy
from torquerig.driver.wire.cia402 import FAULT_RESET, DriveState, decode_state
from torquerig.driver.wire.emcy import EmergencyCode
from torquerig.driver.wire.sdo import SdoAbort

_FAULTY: Final = frozenset({DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE})
_POLL_NS: Final = 5 * MILLISECOND_NS
_POLLS: Final = 40  # a fault reaction that ramps the torque down may take its time
_BIT_CLEAR: Final = 0x0000


@dataclass(frozen=True, slots=True)
class Fault:
    """A drive in fault.

    Attributes:
        node_id: The drive.
        code: Error code, 0 when the drive does not tell.
    """

    node_id: int
    code: int

    @property
    def words(self) -> str:
        """The fault in words and figures."""
        return describe_code(self.code) if self.code else "it does not say why"

    @property
    def is_sibling_stop(self) -> bool:
        """Whether the drive only stopped because another one did."""
        return self.code == EmergencyCode.SIBLING_STOP

    @property
    def is_communication(self) -> bool:
        """Whether it tells of lost communication, and so of an earlier master rather than of the drive."""
        return emcy.is_communication(self.code)


def read_fault(node_id: int, heard: int = 0) -> Job[Fault | None]:
    """A job: the fault a drive is in, None when it is in none.

    Args:
        node_id: The drive.
        heard: Code of its last emergency, for drives whose 603F and 1003 say nothing.
    """
    statusword = yield from _read_number(0x6041)
    if decode_state(statusword) not in _FAULTY:
        return None
    code = yield from _read_or_zero(0x603F)
    if not code:
        code = (yield from _read_or_zero(0x1003, 1)) & 0xFFFF  # the newest entry; its upper half is the maker's
    return Fault(node_id, code or heard)


def reset_fault(node_id: int) -> Job[Fault | None]:
    """A job: reset a drive's fault by the rising edge of the controlword's bit 7; what remains of it, or None."""
    for controlword in (_BIT_CLEAR, FAULT_RESET, _BIT_CLEAR):
        yield Download(0x6040, 0, controlword.to_bytes(2, "little"))
    for _ in range(_POLLS):
        if decode_state((yield from _read_number(0x6041))) not in _FAULTY:
            return None
        yield Pause(_POLL_NS)
    return (yield from read_fault(node_id))


def disable() -> Job[int]:
    """A job: disable a drive's voltage; the statusword that it then has, also when it does not obey."""
    yield Download(0x6040, 0, bytes(2))
    for _ in range(_POLLS):
        statusword = yield from _read_number(0x6041)
        if decode_state(statusword) in DISABLED_STATES:
            break
        yield Pause(_POLL_NS)
    return statusword


def clear_old_faults(service: SdoService, heard: dict[int, int]) -> list[str]:
    """Reset the communication faults that an earlier master left.

    Args:
        service: Reaches the drives.
        heard: The drives, each with the code of its last emergency or 0.

    Returns:
        A sentence for each drive that was reset.

    Raises:
        DriveFault: A drive is in another fault, or stays in fault.
        NoAnswer: Drives are silent.
    """
    found = service.run({node_id: read_fault(node_id, code) for node_id, code in heard.items()})
    faults = [fault for fault in found.values() if fault is not None]
    if others := [fault for fault in faults if not fault.is_communication]:
        raise DriveFault(describe_faults(others))
    remaining = service.run({fault.node_id: reset_fault(fault.node_id) for fault in faults})
    if stuck := [fault for fault in remaining.values() if fault is not None]:
        raise DriveFault(f"{describe_faults(stuck)}, also after a reset")
    return [f"drive {each.node_id} was in fault since communication was lost: {each.words}; reset" for each in faults]


def describe_faults(faults: Sequence[Fault]) -> str:
    """Faults in one sentence, the causes before those that only stopped with them; empty when there is none."""
    stories = [f"drive {fault.node_id} is in fault: {fault.words}" for fault in faults if not fault.is_sibling_stop]
    followers = [fault.node_id for fault in faults if fault.is_sibling_stop]
    if followers:
        stories.append(f"{name_drives(followers)} stopped because a sibling did")
    return "; ".join(stories)


def _read_number(index: int, subindex: int = 0) -> Job[int]:
    return int.from_bytes((yield Upload(index, subindex, NUMBER_BYTES)), "little")


def _read_or_zero(index: int, subindex: int = 0) -> Job[int]:
    """A number, 0 when the drive has no such object or nothing in it."""
    try:
        return (yield from _read_number(index, subindex))
    except SdoAbort:
        return 0
