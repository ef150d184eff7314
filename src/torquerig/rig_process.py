"""Simulated drives in a process of their own, as the process that wants them sees it."""

import os
import signal
import subprocess
import sys
import tempfile
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import IO, TYPE_CHECKING, Final

from torquerig.errors import RigError
from torquerig.rig_orders import Answer, Begin, Begun, Order

if TYPE_CHECKING:
    import can

MODULE: Final = "torquerig.rig_host"
START_LIMIT_S: Final = 180.0  # on a machine that is new to torquerig the plant's integrator is compiled first
ANSWER_LIMIT_S: Final = 60.0
ENDING_LIMIT_S: Final = 10.0
LONGEST_COMPLAINT: Final = 1 << 20  # [byte]


class RigProcess:
    """One rig after another in one process, which is started when the first one begins: starting takes seconds.

    The process ends when it is closed, or when nobody holds the other end of its pipe any more, as when this process
    was killed. It is in a session of its own, so that Ctrl-C reaches this process only.
    """

    def __init__(self) -> None:
        """Start nothing yet."""
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection[object, object] | None = None
        self._errors: IO[bytes] | None = None
        self._shown = 0  # bytes of its errors

    def ask(self, order: Order[Answer]) -> Answer:
        """Have an order carried out.

        Raises:
            RigError: The process did not start, or is gone; says how it ended and its last words.
            ApplicationError, TorqueRigError: The order cannot be carried out.
        """
        if isinstance(order, Begin) and (self._process is None or self._process.poll() is not None):
            self._start()
        answer = self._exchange(order)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def member(self, begun: Begun) -> "can.BusABC":
        """A member of the drives' bus, opened by this process."""
        from torquerig.driver.bus.url import open_python_can  # noqa: PLC0415  (needed only by who wants it)

        return open_python_can(begun.url, bitrate=begun.bitrate)

    def close(self) -> None:
        """End the process, and show what it complained about."""
        if self._process is None or self._connection is None or self._errors is None:
            return
        self._connection.close()
        self._process.terminate()
        try:
            self._process.wait(ENDING_LIMIT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        sys.stderr.write(self._complaints())
        self._errors.close()
        self._process = self._connection = self._errors = None

    def _start(self) -> None:
        self.close()
        ours, theirs = Pipe()
        self._errors, self._shown = tempfile.TemporaryFile(), 0  # noqa: SIM115  (closed with the process)
        with theirs:
            # -P: nothing in the folder where somebody's tests run may stand in for a module
            self._process = subprocess.Popen(  # noqa: S603  (this interpreter, and a module of this package)
                [sys.executable, "-P", "-m", MODULE, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self._errors,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        self._connection = ours

    def _exchange(self, order: Order[Answer]) -> Answer | Exception:
        """Send an order and wait for what is answered."""
        if self._connection is None:
            raise RigError("the simulated drives are not running")
        limit_s = START_LIMIT_S if isinstance(order, Begin) else ANSWER_LIMIT_S
        try:
            self._connection.send(order)
            if self._connection.poll(limit_s):
                answer: Answer | Exception = self._connection.recv()  # type: ignore[assignment]  # what our host sends
                return answer
        except (EOFError, OSError) as error:
            raise RigError(self._obituary()) from error
        self.close()
        raise RigError(f"the simulated drives did not answer within {limit_s:g} s, and were ended")

    def _obituary(self) -> str:
        """How the process ended, with its last words; all of its words go to our standard error."""
        assert self._process is not None  # noqa: S101  (who has a connection has a process)
        self._process.wait(ENDING_LIMIT_S)
        code = self._process.returncode
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"
        complaints = self._complaints()
        sys.stderr.write(complaints)
        return ": ".join([f"the process of the simulated drives ended ({how})", *complaints.strip().splitlines()[-1:]])

    def _complaints(self) -> str:
        """What the process wrote on its standard error since this was last asked."""
        assert self._errors is not None  # noqa: S101  (who has a process has its errors)
        # the file's offset is the process's: reading must not move it
        words = os.pread(self._errors.fileno(), LONGEST_COMPLAINT, self._shown)
        self._shown += len(words)
        return words.decode(errors="replace")
