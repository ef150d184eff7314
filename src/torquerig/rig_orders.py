"""What a simulated rig is told, and what it answers: values that go between processes. Importing them costs nothing."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    import can
    import numpy as np
    from numpy.typing import NDArray

Answer = TypeVar("Answer")


class Order(Generic[Answer]):
    """Something to be done, which is answered by a value of one type, or by an error."""

    __slots__ = ()


class Begun(NamedTuple):
    """Drives that have booted.

    Attributes:
        url: Their bus.
        bitrate: Its bit rate [bit/s].
        node_ids: The drives.
        time_zero_ns: What their time 0 is on the bus clock [ns].
    """

    url: str
    bitrate: int
    node_ids: tuple[int, ...]
    time_zero_ns: int


class Truth(NamedTuple):
    """What the machine really did, one row for each instant.

    Attributes:
        at_ns: Instants of the drives' time, shape (n,) [ns].
        position: The end-effector's position, shape (n, 2) [m].
        velocity: Its velocity, shape (n, 2) [m/s].
        theta: Angles of the actuated joints, shape (n, 3) [rad].
        motor_torque: Torques at the motors, after the current loops' lag, shape (n, 3) [N·m].
    """

    at_ns: "NDArray[np.int64]"
    position: "NDArray[np.float64]"
    velocity: "NDArray[np.float64]"
    theta: "NDArray[np.float64]"
    motor_torque: "NDArray[np.float64]"


@dataclass(frozen=True, slots=True)
class Begin(Order[Begun]):
    """Switch on three drives and their machine, which stands in the home fixture.

    Attributes:
        url: Their bus; None for a unix bus of their own.
        plant: The true machine; None for the configuration's.
        config: A file of the configuration.
        record: A new or empty folder for the record.
        options: Values of the configuration by dotted key.
    """

    url: str | None = None
    plant: str | None = None
    config: Path | None = None
    record: Path | None = None
    options: Mapping[str, object] = field(default_factory=dict)

    def settings(self, url: str) -> dict[str, object]:
        """What differs from the configuration's file, by dotted key, with this bus."""
        plant = {} if self.plant is None else {"simulator.plant": self.plant}
        return {**self.options, **plant, "bus.url": url}


@dataclass(frozen=True, slots=True)
class PowerCycle(Order[None]):
    """Switch drives off and on again; none named: all."""

    node_ids: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Inject(Order[None]):
    """Make a fault happen in a drive, by its name; see `device_sim.drive.Injection`."""

    node_id: int
    fault: str


@dataclass(frozen=True, slots=True)
class TellTruth(Order[Truth]):
    """Tell what the machine did so far."""


@dataclass(frozen=True, slots=True)
class StandStill(Order[None]):
    """Let the drives' time stand still until `GoOn`."""


@dataclass(frozen=True, slots=True)
class GoOn(Order[int]):
    """Let the drives' time go on; the answer is what their time 0 is on the bus clock now [ns]."""


@dataclass(frozen=True, slots=True)
class End(Order[Truth]):
    """Switch everything off, write the record, and tell the whole truth."""


class RigBackend(Protocol):
    """Where simulated drives live, and who carries out what they are told."""

    def ask(self, order: Order[Answer]) -> Answer:
        """Have an order carried out.

        Raises:
            ApplicationError, TorqueRigError: It cannot be; the message says why.
        """
        ...

    def member(self, begun: Begun) -> "can.BusABC":
        """A member of the drives' bus for the user, whoever asks for it closes it."""
        ...

    def close(self) -> None:
        """End the drives, whatever they are doing; may be called again."""
        ...
