"""Real-time scheduling, as far as the machine allows it: under load it decides whether cycles are on time."""

import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def real_time(priority: int) -> Iterator[str]:
    """Run what is inside under SCHED_FIFO if that is allowed; it needs root, CAP_SYS_NICE or an rtprio limit.

    Args:
        priority: 1 to 99; 0 asks for nothing.

    Yields:
        How this thread is scheduled now, in words.
    """
    if priority == 0:
        yield "ordinary scheduling"
        return
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError as error:
        words = f"ordinary scheduling, because SCHED_FIFO is refused ({error.strerror})"
    else:
        words = f"SCHED_FIFO, priority {priority}"
    try:
        yield words
    finally:
        os.sched_setscheduler(0, policy, parameters)
