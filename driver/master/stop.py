"""For a person at the machine: stop all drives, or clear their faults, whatever state things are in.

Nothing is configured, and nobody is asked whether another master is there: a controller that still runs notices that
somebody else commands, and stops too.
"""

from collections.abc import Sequence

from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import DriveError, DriveFault
from torquerig.driver.master.axis import DISABLED_STATES, Axis, state_words
from torquerig.driver.master.faults import Fault, describe_faults, disable, read_fault, reset_fault
from torquerig.driver.master.pump import MILLISECOND_NS, Pump
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.sdo_jobs import BRIEF, Job, SdoService
from torquerig.driver.wire import nmt
from torquerig.driver.wire.cia402 import decode_state
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtCommand


def stop(bus: Bus, axes: Sequence[AxisSettings]) -> list[str]:
    """Zero torque and disable, by every road there is: RPDO, then SDO, then NMT pre-operational.

    Args:
        bus: The bus.
        axes: The drives.

    Returns:
        A sentence a drive, saying where it stands now.

    Raises:
        NoAnswer, DriveError: Drives do not confirm; everything was sent to all of them nevertheless.
        BusError: The bus is gone.
        EdsError, ProfileError: A drive's description cannot be used.
    """
    drives = [Axis(settings) for settings in axes]
    pump = Pump(bus)
    for drive in drives:
        pump.send(Frame(drive.rpdo_cob, bytes(drive.rpdo.size)))
    try:
        statuswords = SdoService(pump).run({drive.node_id: disable() for drive in drives}, BRIEF)
    finally:
        for drive in drives:
            pump.send(nmt.encode_command(NmtCommand.PRE_OPERATIONAL, drive.node_id))
        pump.serve(pump.now_ns() + MILLISECOND_NS)  # so that all is on the wire before the bus is closed
    states = {node_id: decode_state(statusword) for node_id, statusword in statuswords.items()}
    for node_id, state in states.items():
        if state not in DISABLED_STATES:
            raise DriveError(f"drive {node_id} was told to disable, but is in {state_words(state)}")
    return [f"drive {node_id} is in {state_words(state)}" for node_id, state in states.items()]


def reset(bus: Bus, node_ids: Sequence[int]) -> list[str]:
    """Reset the faults of drives, whatever they are, and say what they were; nothing is enabled by it.

    Args:
        bus: The bus.
        node_ids: The drives.

    Returns:
        A sentence a drive.

    Raises:
        DriveFault: A drive stays in fault.
        NoAnswer: Drives are silent.
        BusError: The bus is gone.
    """
    cleared = SdoService(Pump(bus)).run({node_id: _clear(node_id) for node_id in node_ids}, BRIEF)
    if stuck := [remaining for _, remaining in cleared.values() if remaining is not None]:
        raise DriveFault(f"{describe_faults(stuck)}, also after a reset")
    return [
        f"drive {node_id} was in no fault" if fault is None else f"drive {node_id} was in fault: {fault.words}; reset"
        for node_id, (fault, _) in cleared.items()
    ]


def _clear(node_id: int) -> Job[tuple[Fault | None, Fault | None]]:
    """A job: the fault that a drive was in, and what a reset left of it."""
    fault = yield from read_fault(node_id)
    return fault, None if fault is None else (yield from reset_fault(node_id))
