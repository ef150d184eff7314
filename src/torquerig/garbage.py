"""Keeping Python's garbage collector out of real time: a full collection of what is loaded takes 50 ms and more."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def frozen_heap() -> Iterator[None]:
    """Collect now, then leave all that exists out of later collections, which become short.

    Yields:
        Nothing.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


@contextmanager
def no_collections() -> Iterator[None]:
    """Collect now, and not again until the end.

    Yields:
        Nothing.
    """
    was_enabled = gc.isenabled()
    with frozen_heap():
        gc.disable()
        try:
            yield
        finally:
            if was_enabled:
                gc.enable()
