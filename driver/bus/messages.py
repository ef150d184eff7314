"""Between python-can's messages and our frames."""

import can

from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Frame


def check_frame(frame: Frame) -> None:
    """Return if a frame can be on a classic CAN bus.

    Raises:
        ValueError: The identifier does not fit its format, or there are more than 8 bytes.
    """
    highest = 0x1FFF_FFFF if frame.extended else 0x7FF
    if not 0 <= frame.can_id <= highest or len(frame.data) > MAX_DATA_LENGTH:
        raise ValueError(
            f"no classic CAN frame has identifier {frame.can_id:#x} (highest {highest:#x}) and {len(frame.data)} bytes"
        )


def message_of(frame: Frame, timestamp: float = 0.0) -> can.Message:
    """Return the python-can message of a checked frame, with a timestamp [s]."""
    return can.Message(
        timestamp=timestamp,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=len(frame.data),
        data=frame.data,
    )


def flaw_of(message: can.Message) -> str | None:
    """Return why a message is no classic CAN frame ("error", "fd" or "malformed"), or None if it is one."""
    if message.is_error_frame:
        return "error"
    if message.is_fd:
        return "fd"
    highest = 0x1FFF_FFFF if message.is_extended_id else 0x7FF
    if not 0 <= message.arbitration_id <= highest or max(message.dlc, len(message.data)) > MAX_DATA_LENGTH:
        return "malformed"
    return None


def frame_of(message: can.Message) -> Frame:
    """Return the frame of a message without flaw."""
    remote = message.is_remote_frame
    data = bytes(message.dlc) if remote else bytes(message.data)
    return Frame(message.arbitration_id, data, remote, message.is_extended_id)
