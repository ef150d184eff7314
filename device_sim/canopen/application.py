"""What stands behind a CANopen slave, as the slave sees it."""

from enum import Enum, auto
from typing import Protocol

from torquerig.driver.wire.emcy import Emergency


class CommunicationEvent(Enum):
    """What happened on the bus that a device may have to answer by making itself safe."""

    LEFT_OPERATIONAL = auto()  # another NMT state than operational is about to be entered
    POWER_LOST = auto()
    RPDO_MISSING = auto()  # a watched event timer passed
    LIFE_GUARDING_LOST = auto()
    HEARTBEAT_LOST = auto()
    SIBLING_LOST = auto()  # the lost heartbeat was that of a node whose emergencies are heard
    SIBLING_LEFT = auto()  # a node whose heartbeat is watched says that it is operational no more


class Application(Protocol):
    """The device behind the CANopen services."""

    def power_on(self, at_ns: int) -> None:
        """Begin: the objects have their power-on values."""
        ...

    def synchronise(self, at_ns: int) -> None:
        """A SYNC came; nothing is sampled yet, and no synchronous command has taken effect."""
        ...

    def handle_event(self, event: CommunicationEvent, at_ns: int) -> None:
        """Something happened to the communication."""
        ...

    def hear_emergency(self, emergency: Emergency, at_ns: int) -> None:
        """A node of 1028 sent an emergency."""
        ...
