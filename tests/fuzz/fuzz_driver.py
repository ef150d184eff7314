"""A driver at work on a wire that may be hostile: what it does is a plan of words, so that it can be done again.

stop reset group:home,enable,cycle,read,write,wait scan
"""

from collections.abc import Callable, Sequence
from dataclasses import astuple, replace
from functools import cache
from types import MappingProxyType
from typing import Final

import numpy as np
from fuzz_devices import ROTOR, JudgedDrive, JudgedMachine
from fuzz_frames import NODE_IDS
from fuzz_log import Timed
from fuzz_memory import footprint
from fuzz_source import Source, choose, in_one_of
from fuzz_wire import HONEST, NEVER_NS, HostileWire, ReplayedWire, some_hostility

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant.rotor import BareRotor
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.errors import TorqueRigError
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.profile import FirstWrite, TorqueReference, Watchdogs, load_profile
from torquerig.driver.master.profile import parse_address as _address
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.scan import scan
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.master.stop import reset, stop

Mood = Callable[[], None]
Wire = HostileWire | ReplayedWire
GROWTH: Final = 20_000  # elements that a group may hold more than when it was made
LARGEST: Final = 5_000  # elements of one container
_LONGEST_NS: Final = 120 * 1_000_000_000  # for whatever a driver does
_REST_NS: Final = 2_000_000_000
_PERIOD_NS: Final = 4_000_000
_CYCLES: Final = 25
_OUTER: Final = ("scan", "stop", "reset", "group", "group", "group", "guarded")
_INNER: Final = ("cycle", "cycle", "cycle", "read", "write", "wait", "home", "anew", "enable", "unplug")
_GROUPS: Final = ("group", "guarded")


@cache
def axes(kind: str) -> tuple[AxisSettings, ...]:
    """The three drives as a driver knows them, "guarded" those of a make without heartbeat and raw counts."""
    profile = load_profile()
    if kind == "guarded":
        torque = TorqueReference(
            "rated torque", _address("6071"), _address("6077"), rated_object=_address("6076"), rated_unit=1e-3
        )
        profile = replace(
            profile,
            torque=torque,
            rpdo=replace(profile.rpdo, objects=(_address("6040"), torque.target)),
            tpdos=(replace(profile.tpdos[0], objects=(_address("6041"), _address("6064"), torque.actual)),),
            watchdogs=Watchdogs(rpdo_timer=True, guarding=True),
            first=(FirstWrite(_address("2070"), 0, "6071 is the torque target"),),
        )
    return tuple(AxisSettings(node_id, profile) for node_id in NODE_IDS)


def some_plan(source: Source) -> list[str]:
    """What a driver is to do."""
    words = []
    for _ in range(source.integer(1, 3)):
        word = choose(source, _OUTER)
        if word in _GROUPS:
            usual = ["home", "enable", "cycle"] if not in_one_of(source, 4) else []
            word += ":" + ",".join([*usual, *(choose(source, _INNER) for _ in range(source.integer(0, 4)))])
        words.append(word)
    return words


class Driver:
    """Works through plans on one wire.

    Attributes:
        errors: The sentences of what ended its actions.
    """

    def __init__(self, wire: Wire, mood: Mood) -> None:
        """Take the wire.

        Args:
            wire: The wire.
            mood: Called before each action: the wire may change its ways.
        """
        self.errors: list[str] = []
        self._errors_before = 0
        self._wire = wire
        self._mood = mood
        self._bus = LockstepBus(wire)
        self._outer = MappingProxyType(
            {
                "scan": lambda: scan(self._bus),
                "stop": lambda: stop(self._bus, axes("group")),
                "reset": lambda: reset(self._bus, NODE_IDS),
                "rest": self._rest,
                "fine": self._see_that_all_went_well,
            }
        )
        self._inner = MappingProxyType(
            {
                "home": lambda group: group.home(),
                "anew": lambda group: group.home(anew=True),
                "enable": lambda group: group.enable(),
                "cycle": self._cycle,
                "read": lambda group: [group.read(node_id, 0x1008) for node_id in NODE_IDS],
                "write": lambda group: group.write(2, 0x6087, 0, 200_000),
                "wait": lambda group: group.wait(0.05),
                "unplug": lambda _group: setattr(self._wire, "unplugged", True),
            }
        )

    def work(self, plan: Sequence[str]) -> None:
        """Do all that a plan says; an error of the driver's tree ends one action."""
        for word in plan:
            self._mood()
            self._do(word)

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()

    def _do(self, word: str) -> None:
        self._wire.end_ns = self._wire.now_ns() + _LONGEST_NS
        self._wire.unplugged = False
        try:
            outer, _, inner = word.partition(":")
            if outer in _GROUPS:
                self._drive(outer, [each for each in inner.split(",") if each])
            else:
                self._outer[outer]()
        except TorqueRigError as error:
            self.errors.append(_told(error))
        finally:
            self._wire.end_ns = NEVER_NS

    def _rest(self) -> None:
        """Do nothing for a while, and forget what went wrong before."""
        until_ns = self._bus.now_ns() + _REST_NS
        while self._bus.receive(until_ns) is not None:
            pass
        self._errors_before = len(self.errors)

    def _see_that_all_went_well(self) -> None:
        """Fail if something went wrong since the last rest."""
        errors = self.errors[self._errors_before :]
        assert not errors, errors

    def _drive(self, kind: str, words: Sequence[str]) -> None:
        group = AxisGroup(self._bus, axes(kind), GroupSettings(period_ns=_PERIOD_NS))
        least, odd = footprint(group, without=(LockstepBus,)).elements, self._wire.gate.odd
        try:
            with group:
                for word in words:
                    self._mood()
                    self._inner[word](group)
        finally:
            held = footprint(group, without=(LockstepBus,))
            assert held.elements - least <= GROWTH, f"the group holds {held.elements - least} elements more"
            assert held.largest <= LARGEST, f"a container holds {held.largest} elements"
            counted = sum(astuple(group.pump_counts))
            assert counted >= self._wire.gate.odd - odd, f"{counted} counted of {self._wire.gate.odd - odd} frames"

    def _cycle(self, group: AxisGroup) -> None:
        due_ns = group.now_ns()
        for number in range(_CYCLES):
            due_ns += _PERIOD_NS
            sample = group.sample(due_ns)
            assert np.isfinite(sample.q).all()
            assert np.isfinite(sample.torque).all()
            group.command(np.full(len(NODE_IDS), 0.05 if number % 2 else -0.05), due_ns + _PERIOD_NS // 2)


class DriverTarget:
    """A driver, three drives and a hostile wire between them.

    Attributes:
        wire: The wire.
        plan: What the driver has done.
        driver: The driver.
    """

    def __init__(self, source: Source) -> None:
        self.machine = JudgedMachine(BareRotor(ROTOR, axes=len(NODE_IDS)))
        drives = [JudgedDrive(node_id, axis, self.machine) for axis, node_id in enumerate(NODE_IDS)]
        self.network = SimulatedNetwork(SimulatedDevices(drives), 1_000_000)
        self.wire = HostileWire(self.network, source)
        self.plan: list[str] = []
        self.driver = Driver(self.wire, self._change_mood)
        self._source = source
        self._calm = False

    def session(self) -> None:
        """Do something on a hostile wire; then, on an honest one, everything must come to rest, and work again."""
        self._work(some_plan(self._source))
        self._calm = True
        self._work(["rest", "stop"])
        assert not any(self.machine.torques), f"torques after a stop: {self.machine.torques}"
        if not self.wire.touched_drives:  # drives that heard nobody but a driver obey the next one
            self._work(["rest", "reset", "group:anew,enable,cycle", "fine"])
            assert not any(self.machine.torques), f"torques after a run: {self.machine.torques}"

    def _work(self, plan: Sequence[str]) -> None:
        self.plan += plan
        self.driver.work(plan)

    def _change_mood(self) -> None:
        hostile = not self._calm and in_one_of(self._source, 2)
        self.wire.become(some_hostility(self._source) if hostile else HONEST)


def replay(log: Sequence[Timed], plan: Sequence[str]) -> None:
    """Let a driver work through a plan, hearing what is in a log."""
    driver = Driver(ReplayedWire(log), lambda: None)
    try:
        driver.work(plan)
    finally:
        driver.close()


def _told(error: TorqueRigError) -> str:
    """The error's sentence, which must be one."""
    sentence = str(error)
    assert sentence, f"{type(error).__name__} says nothing"
    assert "\n" not in sentence, f"more than a sentence: {sentence}"
    return f"{type(error).__name__}: {sentence}"
