"""Who computes the errors of many plants: this process, or several that do not hear the terminal's signals."""

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Final, NamedTuple, Protocol

from torquerig.configuration import Configuration
from torquerig.errors import RigError
from torquerig.mechanism import warm_up
from torquerig.plant_fit.experiments import Errors, errors_over_the_wire, prepare
from torquerig.schema_machines import Plant

MOST: Final = 8
"""Processes at most: a search rarely has more than a dozen plants to try at once."""


class Task(NamedTuple):
    """One plant to try.

    Attributes:
        plant: The plant.
        which: Which of the thesis' runs.
        wired: Through the whole chain, CANopen frames and all.
    """

    plant: Plant
    which: tuple[int, ...]
    wired: bool = False


class Workers(Protocol):
    """What a search needs of them."""

    def errors(self, tasks: Sequence[Task]) -> list[Errors]:
        """The errors of each task, in the tasks' order."""
        ...


class ThisProcess:
    """Everything here, one after the other."""

    def __init__(self, base: Configuration) -> None:
        """Prepare the experiments of a rig."""
        warm_up()
        self._base = base
        self._experiments = prepare(base)

    def errors(self, tasks: Sequence[Task]) -> list[Errors]:
        """The errors of each task, in the tasks' order."""
        runs = self._experiments.runs
        return [
            errors_over_the_wire(self._base, plant, [runs[place] for place in which])
            if wired
            else self._experiments.errors(plant, which)
            for plant, which, wired in tasks
        ]


class SeveralProcesses:
    """The tasks shared out evenly; what comes out does not depend on how many processes there are."""

    def __init__(self, connections: Sequence[Connection]) -> None:
        """Use processes that `_serve` at the other ends of these connections."""
        self._connections = tuple(connections)

    def errors(self, tasks: Sequence[Task]) -> list[Errors]:
        """The errors of each task, in the tasks' order."""
        found: list[Errors | None] = [None] * len(tasks)
        count = len(self._connections)
        try:
            for place, connection in enumerate(self._connections):
                connection.send(list(tasks[place::count]))
            for place, connection in enumerate(self._connections):
                answer = connection.recv()
                if isinstance(answer, Exception):
                    raise answer
                found[place::count] = answer
        except (EOFError, OSError) as error:
            raise RigError("a process that simulates plants is gone") from error
        return [errors for errors in found if errors is not None]


@contextmanager
def workers(base: Configuration, processes: int | None = None) -> Iterator[Workers]:
    """Start the workers, and end them whatever happens.

    Args:
        base: The rig.
        processes: How many processes; None for one a processor.

    Yields:
        The workers.

    Raises:
        MotionError, ReachError, LimitExceeded: A test motion leaves what the machine may do.
    """
    count = min(processes or os.cpu_count() or 1, MOST)
    if count == 1:
        yield ThisProcess(base)
        return
    prepare(base)  # what cannot be prepared is told by this process, not by each of them
    context = get_context("spawn")  # a fork would take locks of the parent's threads along
    ends = [context.Pipe() for _ in range(count)]
    members = [context.Process(target=_serve, args=(theirs, base), daemon=True) for _, theirs in ends]
    try:
        for member in members:
            member.start()
        for _, theirs in ends:
            theirs.close()
        yield SeveralProcesses([ours for ours, _ in ends])
    finally:
        for member in members:
            if member.pid is not None:
                member.kill()  # it holds nothing that has to be put away
                member.join()
        for ours, _ in ends:
            ours.close()


def _serve(connection: Connection, base: Configuration) -> None:
    """A worker's life: only its parent tells it when to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    here = ThisProcess(base)
    while True:
        try:
            tasks = connection.recv()
        except EOFError:
            return
        try:
            answer: list[Errors] | Exception = here.errors(tasks)
        except Exception as error:  # noqa: BLE001  (it is raised where it can be told)
            answer = error
        connection.send(answer)
