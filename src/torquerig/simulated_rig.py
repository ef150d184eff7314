"""Simulated drives for a user's own driver, script or test, as a context manager.

    with SimulatedRig() as rig:
        bus = can.Bus(interface=rig.interface, channel=rig.channel)

The drives, with node-ids 1, 2 and 3, are what `torquerig sim` is: CANopen slaves with CiA 402, which turn the motors of
a simulated manipulator. They live in a process of their own, in real time, on any bus that processes share; or with
`lockstep:` in this thread, in simulated time.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Final, Self

from torquerig.errors import RigError
from torquerig.rig_orders import (
    Begin,
    Begun,
    End,
    GoOn,
    Inject,
    PowerCycle,
    RigBackend,
    StandStill,
    TellTruth,
    Truth,
)
from torquerig.rig_process import RigProcess

if TYPE_CHECKING:
    import can

LOCKSTEP: Final = "lockstep"


class SimulatedRig:
    """Three simulated drives on a bus, from `with` until its end, whatever ends it.

    When the `with` begins, the drives have booted: their boot-up messages are over, and they are pre-operational. They
    are gone when it ends, and also when this process is killed.
    """

    def __init__(
        self,
        bus: str | None = None,
        *,
        plant: str | None = None,
        config: str | Path | None = None,
        record: str | Path | None = None,
        options: Mapping[str, object] | None = None,
        process: RigProcess | None = None,
    ) -> None:
        """Decide what to simulate; nothing is started yet.

        Args:
            bus: The URL of the bus: `unix:FOLDER`, `socketcan:vcan0`, `INTERFACE:CHANNEL` or `lockstep:`; None for a
                unix bus in a temporary folder, where nobody else is. The configuration's `bus.url` does not count.
            plant: The true machine: `ideal`, `identified`, `fitted`, or one of the configuration's.
            config: A TOML file with what differs from the shipped configuration.
            record: A new or empty folder for the record, which is written when the rig ends.
            options: Values by dotted key that win over the file, as {"drive.boot": 0.5}.
            process: A process to live in, which is kept for the next rig; None for one that ends with this rig.
        """
        self._begin: Final = Begin(
            url=_absolute(bus),
            plant=plant,
            config=None if config is None else Path(config).absolute(),
            record=None if record is None else Path(record).absolute(),
            options=dict(options or {}),
        )
        self._kept_process: Final = process
        self._backend: RigBackend | None = None
        self._begun: Begun | None = None
        self._member: can.BusABC | None = None
        self._truth: Truth | None = None

    def __enter__(self) -> Self:
        """Start the drives, and wait until they have booted.

        Raises:
            BusUrlError, BusError: The bus cannot be opened.
            ConfigurationError: Plant, file or options cannot be used.
            RecordError: The record's folder cannot be used.
            RigError: The drives' process did not start.
        """
        if self._backend is not None:
            raise RigError("this rig is running already")
        backend = self._make_backend()
        try:
            self._begun = backend.ask(self._begin)
        except BaseException:
            self._let_go(backend)
            raise
        self._backend = backend
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End the drives, and keep what they know.

        Raises:
            BusError, RigError: The drives had failed before; not told beside another error.
            RecordError: The record cannot be written.
        """
        backend = self._running
        try:
            if self._member is not None:
                self._member.shutdown()
            self._truth = backend.ask(End())
        except Exception:
            if error is None:
                raise
        finally:
            self._member = self._backend = None
            self._let_go(backend)

    @property
    def url(self) -> str:
        """The bus, as `torquerig nodes --bus` and `torquerig run --bus` take it."""
        return self._facts.url

    @property
    def interface(self) -> str:
        """The interface of the bus, as python-can calls it."""
        return self.url.partition(":")[0]

    @property
    def channel(self) -> str:
        """The channel of the bus, as python-can calls it; in lockstep there is none to open, only `bus`."""
        return self.url.partition(":")[2]

    @property
    def node_ids(self) -> tuple[int, ...]:
        """The drives."""
        return self._facts.node_ids

    @property
    def time_zero_ns(self) -> int:
        """What the drives' time 0 is on `time.monotonic_ns()` [ns], or in lockstep on the bus; see `frozen`."""
        return self._facts.time_zero_ns

    @property
    def bus(self) -> "can.BusABC":
        """A python-can bus on which the drives are, closed when the rig ends.

        In real time it is one more member of the bus, opened at first use. In lockstep it is the only one, and its time
        is simulated: it passes while somebody waits in `recv`.

        Raises:
            BusUrlError, BusError: The bus cannot be opened.
        """
        if self._member is None:
            self._member = self._running.member(self._facts)
        return self._member

    def truth(self) -> Truth:
        """What the machine really did, in rows `simulator.record_period` apart; also after the rig has ended.

        Raises:
            RigError: The rig never ran.
        """
        if self._backend is not None:
            return self._backend.ask(TellTruth())
        if self._truth is None:
            raise RigError("this rig has not run: there is no truth to tell")
        return self._truth

    def power_cycle(self, *node_ids: int) -> None:
        """Switch drives off and on again; only what 0x1010 stored stays, and the encoder is 0 wherever it stands.

        Args:
            node_ids: Which drives; none named: all.

        Raises:
            ConfigurationError: There is no such drive.
        """
        self._running.ask(PowerCycle(node_ids))

    def inject(self, node_id: int, fault: str) -> None:
        """Make a fault happen, as an SDO write of its number to 0x2F00 does.

        Args:
            node_id: In which drive.
            fault: `overcurrent`, `encoder-loss`, `motor-temperature`, `device-temperature`, `undervoltage`,
                `overvoltage`; or `clear`, which ends all that last.

        Raises:
            ConfigurationError: There is no such drive, or no such fault.
        """
        self._running.ask(Inject(node_id, fault))

    @contextmanager
    def frozen(self) -> Iterator[None]:
        """Let the drives' time stand still: no watchdog runs out, nothing is heard or said, the machine stops dead.

        Frames that come meanwhile are heard at that same instant; the drives' time then goes on from there, and
        `time_zero_ns` has moved by as long as it stood.

        Yields:
            Nothing.
        """
        backend = self._running
        backend.ask(StandStill())
        try:
            yield
        finally:
            self._begun = self._facts._replace(time_zero_ns=backend.ask(GoOn()))

    @property
    def _running(self) -> RigBackend:
        if self._backend is None:
            raise RigError("this rig is not running: its drives live inside its `with` only")
        return self._backend

    @property
    def _facts(self) -> Begun:
        if self._begun is None:
            raise RigError("this rig has not run: its bus is there inside its `with` only")
        return self._begun

    def _make_backend(self) -> RigBackend:
        if self._begin.url is not None and self._begin.url.partition(":")[0] == LOCKSTEP:
            from torquerig.rig_lockstep import LockstepRig  # noqa: PLC0415  (imports the whole simulator)

            return LockstepRig()
        return self._kept_process or RigProcess()

    def _let_go(self, backend: RigBackend) -> None:
        if backend is not self._kept_process:
            backend.close()


def _absolute(url: str | None) -> str | None:
    """The URL with its folder, if it is a folder's, named from the root: the drives' process may stand elsewhere."""
    interface, _, folder = (url or "").partition(":")
    return f"{interface}:{Path(folder).absolute()}" if interface == "unix" and folder else url
