"""All axes of a machine as one: enabled together or not at all, stopped together, left disabled.

    with AxisGroup(bus, axes) as group:
        group.home()
        notices = group.enable()
        sample = group.sample(due_ns)
        group.command(tau_m, due_ns)

A group is what the loop calls joints: `now_ns`, `sample` and `command`.
"""

from collections.abc import Sequence
from types import TracebackType
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import EnablingRefused, TorqueRigError
from torquerig.driver.master.axis import Axis
from torquerig.driver.master.homing import home_axes
from torquerig.driver.master.objects import Value
from torquerig.driver.master.pump import SECOND_NS, PumpCounts
from torquerig.driver.master.samples import AxisSample, CycleCounts, RawSample
from torquerig.driver.master.scale import AxisScale, AxisSettings
from torquerig.driver.master.session import DriveSession
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.wire.emcy import Emergency

_tuple: Final = tuple.__new__  # a named tuple's own constructor is a call more, in Python
_ATTEMPTS_TO_LEAVE = 3  # a person who presses Ctrl-C again must not keep the drives from being disabled


class AxisGroup:
    """A group of drives, from `with` to its end.

    Between calls nobody serves the bus: once enabled, `sample` and `command` are to be called in every period, or the
    drives' watchdogs stop them. Calls that take longer (`read`, `write`, `wait`) go on with zero torque.
    """

    def __init__(self, bus: Bus, axes: Sequence[AxisSettings], settings: GroupSettings | None = None) -> None:
        """Read the EDSs and prepare; nothing is sent before `with`.

        Args:
            bus: The bus; it stays open when the group is left.
            axes: The axes, n of them; all arrays keep their order.
            settings: What holds for all of them.

        Raises:
            ValueError: Two axes have one node-id.
            EdsError, ProfileError: A drive's description cannot be used.
        """
        self._session = session = DriveSession(bus, axes, settings or GroupSettings())
        self._exchange, self._watch, self._pump = session.exchange, session.watch, session.pump
        self._scales: tuple[AxisScale, ...] = ()
        self._notices: list[str] = []

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The drives."""
        return self._session.axes

    @property
    def session(self) -> DriveSession:
        """What the group stands on, for other devices on its bus (`master.transducer`)."""
        return self._session

    @property
    def is_homed(self) -> bool:
        """Whether all positions refer to the home fixture, as of the last statuswords."""
        return all(axis.is_homed for axis in self.axes)

    @property
    def cycle_counts(self) -> CycleCounts:
        """What happened in the cycles so far."""
        return self._session.exchange.counts

    @property
    def pump_counts(self) -> PumpCounts:
        """Frames that were of no use so far."""
        return self._session.pump.counts

    @property
    def emergencies(self) -> tuple[Emergency, ...]:
        """The last emergencies heard, oldest first."""
        return tuple(self._session.watch.emergencies)

    def __enter__(self) -> Self:
        """Listen for other masters, configure all drives and start the cycle; no drive is enabled yet.

        Raises:
            SecondMaster: Another master was heard.
            NoAnswer: Drives are silent.
            ConfigurationMismatch: A drive is of another make, refuses a value or reads back another.
            EnablingRefused: A watchdog cannot be armed.
            BusError: The bus is gone.
        """
        try:
            self._session.open()
            self._scales = tuple(axis.scale for axis in self.axes if axis.scale is not None)
        except BaseException as error:
            self._leave(error)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End at zero torque and disabled, see that it is so, and raise when it is not."""
        self._leave(error)

    def now_ns(self) -> int:
        """The bus clock [ns]."""
        return self._session.pump.now_ns()

    def enable(self) -> list[str]:
        """Enable all drives in the same cycle, or none.

        Communication faults that an earlier master left are reset.

        Returns:
            A sentence for each fault that was reset, by this or by `home`.

        Raises:
            DriveFault: A drive is in another fault, or fell into one.
            EnablingRefused: A watchdog is not armed, or a drive does not walk.
            NoAnswer, BusError, SecondMaster: As their names say; no drive is enabled then.
        """
        session = self._session
        self._notices += session.clear_old_faults()
        session.verify_watchdogs()
        try:
            session.walk(self.axes, {axis.node_id: axis.settings.profile.mode for axis in self.axes})
        except BaseException:
            session.stop()
            raise
        notices, self._notices = self._notices, []
        return notices

    def home(self, q_home: Sequence[float] | None = None, *, anew: bool = False) -> bool:
        """Give the positions their meaning while the machine is in its home fixture, unless they have it.

        Drives that were homed are left alone, wherever the machine stands. If only some were, they must stand in the
        fixture, and the others are homed there.

        Args:
            q_home: Joint angles in the fixture, n of them [rad]; None: the settings'.
            anew: Home all drives, whatever they say.

        Returns:
            Whether a drive was homed.

        Raises:
            NotHomed: The machine does not stand in the fixture, a drive was homed to another angle, or homing failed.
            DriveFault, EnablingRefused, NoAnswer: As in `enable`.
        """
        session = self._session
        if session.watch.armed:
            raise EnablingRefused("drives are homed before they are enabled, not while they run")
        self._notices += session.clear_old_faults()
        session.verify_watchdogs()
        angles = [axis.settings.home for axis in self.axes] if q_home is None else q_home
        positions = [scale.position(angle) for scale, angle in zip(self._scales, angles, strict=True)]
        try:
            return home_axes(session, positions, anew=anew)
        finally:
            session.stop()

    def sample(self, due_ns: int) -> AxisSample:
        """Wait until `due_ns`, SYNC, and return when all axes answered or half a period has passed.

        Raises:
            DriveFault: A drive fell into fault; the group is stopped.
            NoAnswer: A drive fell silent; the group is stopped.
            SecondMaster: Another master was heard; the group is stopped.
            BusError: The bus is gone.
        """
        exchange = self._exchange
        if (port := exchange.port) is not None:
            complete = exchange.ask(due_ns)
            if self._watch.troubles:
                self._stop_on_trouble()
            heard = port.heard()
            return _tuple(AxisSample, (port.sync_ns, heard[0], heard[1], complete, heard[2]))
        raw = self.sample_raw(due_ns)
        scales, positions, torques = self._scales, raw.positions.tolist(), raw.torques.tolist()
        return AxisSample(
            raw.at_ns,
            np.array([scale.angle(position) for scale, position in zip(scales, positions, strict=True)]),
            np.array([scale.torque(counts) for scale, counts in zip(scales, torques, strict=True)]),
            raw.complete,
            raw.answered_ns,
        )

    def command(self, tau_m: NDArray[np.float64], due_ns: int) -> None:
        """Wait until `due_ns` (at once when it is past) serving the bus, then send torques and controlwords.

        Args:
            tau_m: Motor torques, shape (n,) [N·m at the motor]; held within what the drives' objects can carry.
            due_ns: When to send [ns].

        Raises:
            ValueError: A torque is not a number; nothing is sent.
            DriveFault, NoAnswer, SecondMaster, BusError: As in `sample`.
        """
        exchange = self._exchange
        if (port := exchange.port) is None:
            torques = zip(self._scales, tau_m.tolist(), strict=True)
            self.command_raw([scale.torque_counts(torque) for scale, torque in torques], due_ns)
            return
        port.want(tau_m)
        if port.sync_ns < due_ns and self._pump.now_ns() < due_ns:
            self._pump.serve(due_ns)
        if self._watch.troubles:
            self._stop_on_trouble()
        if exchange.command(port, True):  # noqa: FBT003  (compiled code knows no keywords)
            port.hand_out()
            self._stop_on_trouble()
            exchange.command(port, False)  # noqa: FBT003

    def sample_raw(self, due_ns: int) -> RawSample:
        """As `sample`, in the drives' own counts: for calibration."""
        sample = self._session.exchange.sample(due_ns)
        self._stop_on_trouble()
        return sample

    def command_raw(self, counts: Sequence[int], due_ns: int) -> None:
        """As `command`, in the drives' own counts: for calibration.

        Raises:
            ValueError: A value does not fit the torque object; nothing is sent.
        """
        session = self._session
        if session.pump.now_ns() < due_ns:
            session.pump.serve(due_ns)
        self._stop_on_trouble()
        session.exchange.send_torques(counts)

    def wait(self, seconds: float) -> None:
        """Go on with zero torque for a time [s].

        Raises:
            DriveFault, NoAnswer, SecondMaster, BusError: As in `sample`.
        """
        session = self._session
        session.serve_until(lambda: bool(session.watch.troubles), round(seconds * SECOND_NS))
        self._stop_on_trouble()

    def read(self, node_id: int, index: int, subindex: int = 0) -> Value:
        """One object of one drive, typed by its EDS.

        Raises:
            EdsError: The EDS does not hold it.
            SdoAbort: The drive refuses.
            NoAnswer: The drive is silent.
        """
        value = self._session.service.run({node_id: self._axis(node_id).objects.read(index, subindex)})[node_id]
        self._stop_on_trouble()
        return value

    def write(self, node_id: int, index: int, subindex: int, value: Value) -> None:
        """Write one object of one drive, typed by its EDS.

        Raises:
            ValueError: The value does not fit the object's type.
            EdsError, SdoAbort, NoAnswer: As in `read`.
        """
        self._session.service.run({node_id: self._axis(node_id).objects.write(index, subindex, value)})
        self._stop_on_trouble()

    def _axis(self, node_id: int) -> Axis:
        for axis in self.axes:
            if axis.node_id == node_id:
                return axis
        raise ValueError(f"drive {node_id} is not of this group")

    def _stop_on_trouble(self) -> None:
        if self._session.watch.troubles:
            self._session.cut()
            raise self._session.explain()

    def _leave(self, error: BaseException | None) -> None:
        """Close the session; a failure to do so is a note to the error that is on its way, or else raised."""
        interrupt: BaseException | None = None
        for _ in range(_ATTEMPTS_TO_LEAVE):
            try:
                self._session.close()
                break
            except TorqueRigError as failure:
                if error is None:
                    raise
                error.add_note(str(failure))
                break
            except (KeyboardInterrupt, SystemExit) as again:
                interrupt = again
        if interrupt is not None:
            raise interrupt
