"""Pieces of conversations with an enabled drive: how it is enabled, and what it is asked then."""

CYCLE_OFF = "> 601#23 06 10 00 00 00 00 00\n < 581#60 06 10 00 00 00 00 00"
ENABLE = """
    > 000#01 01
    > 201#06 00 00 00
    > 201#07 00 00 00
    > 201#0F 00 00 00"""
IS = "\n {at} > 601#40 41 60 00 00 00 00 00\n {at} < 581#4B 41 60 00 {status} 00 00"
DEMAND = "\n {at} > 601#40 74 60 00 00 00 00 00\n {at} < 581#4B 74 60 00 {torque} 00 00"


def status(at: str, statusword: str) -> str:
    """Asking for the statusword at a time, and the answer."""
    return IS.format(at=at, status=statusword)


def demand(at: str, torque: str) -> str:
    """Asking for the torque demand at a time, and the answer."""
    return DEMAND.format(at=at, torque=torque)
