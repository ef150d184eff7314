"""A person at the keyboard, asked between the cycles of a procedure."""

import os
import select
import termios

import click

from torquerig.errors import ConfigurationError

_CHUNK = 4096


class Keyboard:
    """Lines that are typed on standard input; satisfies `calibration.torque_sensors.Typist`."""

    def __init__(self, *, wait: bool, descriptor: int = 0) -> None:
        """Begin.

        Args:
            wait: Whether `answer` may wait for a line: where time is simulated it stands still meanwhile.
            descriptor: What is read.
        """
        self._timeout = None if wait else 0.0
        self._descriptor = descriptor
        self._typed = b""

    def ask(self, question: str) -> None:
        """Show a question on standard error; what was typed at a terminal before it is forgotten.

        A program that writes into a pipe has no eyes, and its lines are taken in their order.
        """
        if os.isatty(self._descriptor):
            termios.tcflush(self._descriptor, termios.TCIFLUSH)
            self._typed = b""
        click.echo(f"\n{question}", err=True)

    def answer(self) -> str | None:
        """The next line; None while there is none.

        Raises:
            ConfigurationError: Nothing more can come.
        """
        while b"\n" not in self._typed:
            ready, _, _ = select.select([self._descriptor], [], [], self._timeout)
            if not ready:
                return None
            more = os.read(self._descriptor, _CHUNK)
            if not more:
                raise ConfigurationError("standard input has ended before every level had its reading")
            self._typed += more
        line, _, self._typed = self._typed.partition(b"\n")
        return line.decode(errors="replace")
