"""Conversations with the SDO servers of several drives at once, each a generator that reads like a sequence.

    def serial_number() -> Job[bytes]:
        return (yield Upload(0x1018, 4))

A job yields what it wants next and gets the answer back, or the error thrown in. Channels step the jobs from what the
pump hands them, so many conversations go on while the pump sends SYNC, heartbeat and RPDOs.

A lost answer is never answered by repeating a segment: the server may have taken it, and the toggle bit would then be
wrong. The transfer is aborted and starts again from its first message.
"""

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from torquerig.driver.errors import NoAnswer, TorqueRigError
from torquerig.driver.master.pump import FAR_NS, MILLISECOND_NS, SECOND_NS, Pump, name_drives
from torquerig.driver.master.sdo_client import MAX_BYTES, SdoDownload, SdoUpload
from torquerig.driver.wire import cob, sdo
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo import SdoAbort

T = TypeVar("T")

NUMBER_BYTES: Final = 8  # no number has more


@dataclass(frozen=True, slots=True)
class Upload:
    """Read an object; its bytes come back, if they are not more than `max_bytes`: a server might never end."""

    index: int
    subindex: int = 0
    max_bytes: int = MAX_BYTES


@dataclass(frozen=True, slots=True)
class Download:
    """Write an object; b"" comes back."""

    index: int
    subindex: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Pause:
    """Wait [ns]; b"" comes back."""

    duration_ns: int


Step = Upload | Download | Pause
Job = Generator[Step, bytes, T]


@dataclass(frozen=True, slots=True)
class Patience:
    """How long an SDO server may take.

    Attributes:
        answer_ns: For each answer [ns].
        attempts: Whole transfers tried before the drive counts as silent.
        spacing_ns: Time between the beginnings of two transfers, of whichever drives [ns].
    """

    answer_ns: int = 300 * MILLISECOND_NS
    attempts: int = 3
    spacing_ns: int = 0

    @property
    def total_s(self) -> float:
        """The longest time until a silent drive is noticed [s]."""
        return self.answer_ns * self.attempts / SECOND_NS


USUAL: Final = Patience()
BRIEF: Final = Patience(answer_ns=100 * MILLISECOND_NS, attempts=2)


@dataclass(slots=True)
class Turns:
    """When transfers may begin, of all drives on a bus: one after the other.

    Attributes:
        free_ns: When the next one may begin [ns].
    """

    free_ns: int = 0

    def take(self, now_ns: int, spacing_ns: int) -> int:
        """Take the next turn, and say when it is [ns]; without a spacing nobody waits for his turn."""
        if not spacing_ns:
            return now_ns
        turn_ns = max(now_ns, self.free_ns)
        self.free_ns = turn_ns + spacing_ns
        return turn_ns


class SdoChannel:
    """The one SDO channel to a drive, running one job at a time.

    Attributes:
        due_ns: When the next transfer begins, an answer is overdue, or a pause is over [ns].
        done: Whether the last job has ended; see `outcome`.
    """

    def __init__(self, pump: Pump, node_id: int, turns: Turns) -> None:
        self.due_ns = FAR_NS
        self.done = True
        self._turns = turns
        self._pump = pump
        self._node_id = cob.check_node_id(node_id)
        self._job: Job[Any] | None = None
        self._result: Any = None
        self._error: TorqueRigError | None = None
        self._step: Step | None = None
        self._transfer: SdoUpload | SdoDownload | None = None
        self._patience = USUAL
        self._attempts_left = 0
        pump.handlers[cob.SDO_RESPONSE + node_id] = self._hear

    def start(self, job: Job[Any], patience: Patience = USUAL) -> None:
        """Begin a job; one still under way is given up.

        Raises:
            BusError: The bus does not take the first message.
        """
        self._give_up_transfer()
        if self._job is not None:
            self._job.close()
        self._job, self._patience = job, patience
        self._result, self._error = None, None
        if self.done:
            self.done = False
            self._pump.add_timed(self)
        self._resume(None)

    def outcome(self) -> Any:  # noqa: ANN401 - the job's own type
        """What the job returned.

        Raises:
            TorqueRigError: What ended the job: NoAnswer, SdoAbort, or what it raised itself.
        """
        if self._error is not None:
            raise self._error
        return self._result

    def close(self) -> None:
        """Give up what is under way and leave the pump."""
        self._give_up_transfer()
        self._end(None, None)
        self._pump.handlers.pop(cob.SDO_RESPONSE + self._node_id, None)

    def fire(self, now_ns: int) -> None:
        """A pause is over, the next transfer is due, or an answer is overdue."""
        if isinstance(self._step, Pause):
            self._resume(b"")
            return
        self._give_up_transfer()
        if self._attempts_left > 0:
            self._begin_transfer(now_ns)
        else:
            silence = NoAnswer(f"no answer from {name_drives([self._node_id])} within {self._patience.total_s:g} s")
            self._resume(None, silence)

    def _resume(self, answer: bytes | None, error: TorqueRigError | None = None) -> None:
        """Give the job its answer and begin what it wants next."""
        job = self._job
        if job is None:
            return
        self._transfer = None
        try:
            # the first send to a generator must be None, whatever it is typed to take
            self._step = job.throw(error) if error is not None else job.send(answer)  # type: ignore[arg-type]
        except StopIteration as end:
            self._end(end.value, None)
        except TorqueRigError as failure:
            self._end(None, failure)
        else:
            now_ns = self._pump.now_ns()
            if isinstance(self._step, Pause):
                self.due_ns = now_ns + self._step.duration_ns
            else:
                self._attempts_left = self._patience.attempts
                self.due_ns = self._turns.take(now_ns, self._patience.spacing_ns)
                if answer is None and error is None and self.due_ns <= now_ns:
                    self._begin_transfer(now_ns)

    def _begin_transfer(self, now_ns: int) -> None:
        step = self._step
        if isinstance(step, Upload):
            self._transfer = SdoUpload(step.index, step.subindex, max_bytes=step.max_bytes)
        elif isinstance(step, Download):
            self._transfer = SdoDownload(step.index, step.subindex, step.data)
        else:
            return
        self._attempts_left -= 1
        self.due_ns = now_ns + self._patience.answer_ns
        self._send(self._transfer.request)

    def _hear(self, at_ns: int, data: bytes) -> None:
        transfer, counts = self._transfer, self._pump.counts
        if transfer is None:
            counts.unknown += 1
            return
        ignored = transfer.ignored
        try:
            request = transfer.step(data)
        except SdoAbort as abort:
            if transfer.farewell is not None:
                self._send(transfer.farewell)
            self._resume(None, abort)
            return
        if transfer.ignored > ignored:
            counts.unknown += len(data) == sdo.MESSAGE_LENGTH
            counts.malformed += len(data) != sdo.MESSAGE_LENGTH
        elif request is not None:
            self.due_ns = at_ns + self._patience.answer_ns
            self._send(request)
        elif transfer.done:
            self._resume(transfer.result if isinstance(transfer, SdoUpload) else b"")

    def _give_up_transfer(self) -> None:
        if self._transfer is not None:
            self._send(self._transfer.abort())
            self._transfer = None

    def _end(self, result: object, error: TorqueRigError | None) -> None:
        self._job = self._step = self._transfer = None
        self._result, self._error = result, error
        self.due_ns = FAR_NS
        self.done = True
        self._pump.remove_timed(self)  # an idle channel costs the cycle nothing

    def _send(self, message: bytes) -> None:
        self._pump.send(Frame(cob.SDO_REQUEST + self._node_id, message))


class SdoService:
    """The SDO channels of all drives on a pump.

    Attributes:
        patience: For runs that do not say otherwise.
    """

    def __init__(self, pump: Pump) -> None:
        self.patience = USUAL
        self._turns = Turns()
        self._pump = pump
        self._channels: dict[int, SdoChannel] = {}

    def channel(self, node_id: int) -> SdoChannel:
        """The channel to a drive; there is never a second one.

        Raises:
            ValueError: The node-id is not 1 to 127.
        """
        if node_id not in self._channels:
            self._channels[node_id] = SdoChannel(self._pump, node_id, self._turns)
        return self._channels[node_id]

    def run(self, jobs: Mapping[int, Job[T]], patience: Patience | None = None) -> dict[int, T]:
        """Run one job a drive, all at once, serving the bus until all have ended.

        Returns:
            What each job returned, by node-id.

        Raises:
            NoAnswer: Drives are silent; all of them are named.
            TorqueRigError: What ended a job, of the first drive in order.
            BusError: The bus is gone.
        """
        patience = patience or self.patience
        channels = {node_id: self.channel(node_id) for node_id in jobs}
        for node_id, job in jobs.items():
            channels[node_id].start(job, patience)
        self._pump.serve(FAR_NS, lambda: all(channel.done for channel in channels.values()))
        results: dict[int, T] = {}
        errors: dict[int, TorqueRigError] = {}
        for node_id, channel in channels.items():
            try:
                results[node_id] = channel.outcome()
            except TorqueRigError as error:
                errors[node_id] = error
        silent = [node_id for node_id, error in errors.items() if isinstance(error, NoAnswer)]
        if silent:
            raise NoAnswer(f"no answer from {name_drives(silent)} within {patience.total_s:g} s")
        if errors:
            raise next(iter(errors.values()))
        return results
