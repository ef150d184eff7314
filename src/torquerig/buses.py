"""On which bus each drive is: one for all of them, or several in one rig."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Protocol, runtime_checkable

from torquerig.driver.bus.interface import Tap
from torquerig.driver.bus.url import LOCKSTEP
from torquerig.record import channel_name
from torquerig.schema import Rig

UNIX: Final = "unix"


@runtime_checkable
class FrameLog(Protocol):
    """What keeps the frames of several buses apart."""

    def tap_of(self, place: int) -> Tap:
        """The tap for the frames of one bus, by its place among `bus_urls`."""
        ...


def bus_urls(rig: Rig) -> tuple[str, ...]:
    """The buses of a rig, each once: that of `bus.url`, then the others in the order of the legs."""
    return tuple(dict.fromkeys((rig.bus.url, *(axis.bus or rig.bus.url for axis in rig.axes.legs))))


def homes_of(rig: Rig) -> dict[int, int]:
    """The place of each drive's bus among `bus_urls`, by node-id."""
    urls = bus_urls(rig)
    return {axis.node_id: urls.index(axis.bus or rig.bus.url) for axis in rig.axes.legs}


def words_for(urls: Sequence[str]) -> str:
    """Buses in words: "unix:/tmp/a and unix:/tmp/b"."""
    return " and ".join(filter(None, (", ".join(urls[:-1]), urls[-1])))


def is_simulated(url: str) -> bool:
    """Whether a bus is a simulated wire inside this process."""
    return url.partition(":")[0] == LOCKSTEP


def same_place(url: str) -> str:
    """The bus under the one name that all its names share: a folder's from the root."""
    interface, _, channel = url.partition(":")
    return f"{UNIX}:{os.path.abspath(channel)}" if interface == UNIX else url


def channel_names(urls: Sequence[str]) -> tuple[str, ...]:
    """What buses are called in a log, without blanks, each name once.

    Args:
        urls: The buses, each once.

    Returns:
        One bus: its channel where that is a name, else its scheme. Several: the last parts of their channels where
        these are names that differ, else the scheme and a number from 1.
    """
    if len(urls) == 1:
        return (channel_name(urls[0]),)
    names = [Path(url.partition(":")[2]).name or url.partition(":")[0] for url in urls]
    if all(name.isalnum() for name in names) and len(set(names)) == len(names):
        return tuple(names)
    return tuple(f"{url.partition(':')[0]}{number}" for number, url in enumerate(urls, start=1))
