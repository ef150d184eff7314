"""What a rig refuses, in one sentence each."""

from __future__ import annotations

import pytest

from torquerig import SimulatedRig
from torquerig.driver.errors import BusUrlError
from torquerig.errors import ConfigurationError, RecordError, RigError


@pytest.mark.parametrize(
    ("keywords", "error", "words"),
    [
        ({"bus": "unix:/proc/rig"}, BusUrlError, "'unix:/proc/rig' cannot be opened: no unix bus in /proc/rig: "),
        ({"bus": "socketcan:can7"}, BusUrlError, "socketcan:can7: "),
        ({"bus": "bus"}, BusUrlError, "'bus' is no bus URL, for want of a colon: "),
        ({"bus": "virtual:0"}, ConfigurationError, "bus.url = 'virtual:0' cannot be for drives in a process of their"),
        ({"bus": "lockstep:0"}, BusUrlError, "'lockstep:0': the lockstep bus has no channels"),
        ({"plant": "rubber"}, ConfigurationError, "SimulatedRig: simulator.plant = 'rubber' is not a plant; there are"),
        ({"options": {"drive.bot": 1.0}}, ConfigurationError, "SimulatedRig: drive.bot "),
        ({"config": "/no/such.toml"}, ConfigurationError, "cannot read the configuration /no/such.toml: "),
        ({"record": "/"}, RecordError, "/ is not empty, and a record is never overwritten"),
    ],
    ids=lambda each: "-".join(each) if isinstance(each, dict) else "",
)
def test_what_cannot_be_begins_no_rig_and_is_told_as_one_sentence(process, keywords, error, words):
    rig = SimulatedRig(**keywords, process=process)
    with pytest.raises(error) as refusal:
        rig.__enter__()
    assert str(refusal.value).startswith(words)
    assert "\n" not in str(refusal.value)
    with SimulatedRig(process=process) as next_rig:
        assert next_rig.node_ids == (1, 2, 3)


@pytest.mark.parametrize("bus", [None, "lockstep:"])
def test_a_drive_or_a_fault_that_does_not_exist_is_refused_and_the_rig_goes_on(process, bus):
    with SimulatedRig(bus, process=process) as rig:
        with pytest.raises(ConfigurationError, match=r"^there is no drive 7: 1, 2, 3$"):
            rig.power_cycle(1, 7)
        with pytest.raises(ConfigurationError, match=r"^there is no drive 0: 1, 2, 3$"):
            rig.inject(0, "overcurrent")
        with pytest.raises(ConfigurationError, match=r"^there is no fault 'rust': clear, overcurrent, "):
            rig.inject(1, "rust")
        assert rig.bus.recv(20.0) is not None


def test_a_rig_cannot_be_entered_twice(rig):
    with pytest.raises(RigError, match="running already"):
        rig.__enter__()
