"""The object store alone, over a dictionary made here: types, access rules, limits, sources, guards, watchers."""

from __future__ import annotations

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.canopen.timers import Timers
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort


def variable(index: int, data_type: int, access: str, default: object = None, low=None, high=None) -> ODVariable:
    item = ODVariable(f"object {index:04X}", index)
    item.data_type, item.access_type, item.default, item.min, item.max = data_type, access, default, low, high
    item.pdo_mappable = True
    return item


@pytest.fixture
def store() -> ObjectStore:
    dictionary = canopen.ObjectDictionary()
    for item in (
        variable(0x0003, datatypes.INTEGER16, "const"),
        variable(0x2000, datatypes.INTEGER16, "rw", -3, low=-10, high=10),
        variable(0x2001, datatypes.UNSIGNED32, "wo", 7),
        variable(0x2002, datatypes.VISIBLE_STRING, "rw", "before"),
        variable(0x2003, datatypes.UNSIGNED64, "ro", 1 << 40),
        variable(0x2004, datatypes.UNSIGNED8, "rwr", 1),
        variable(0x2005, datatypes.UNSIGNED8, "rww", 1),
        variable(0x2006, datatypes.REAL32, "rw", 0),
    ):
        dictionary.add_object(item)
    return ObjectStore(dictionary, Timers(5), reaction_ns=100)


def aborted(action, *arguments) -> int:
    with pytest.raises(SdoAbort) as caught:
        action(*arguments)
    return caught.value.code


def test_values_have_the_bytes_of_their_types(store):
    assert store.read(0x2000, 0) == b"\xfd\xff"
    assert store.read(0x2002, 0) == b"before"
    assert store.read(0x2003, 0) == (1 << 40).to_bytes(8, "little")
    store.write(0x2000, 0, b"\x05\x00")
    store.write(0x2002, 0, b"after")
    assert store.get(0x2000) == 5
    assert store.read(0x2002, 0) == b"after"


def test_data_types_are_no_objects_but_dummies(store):
    assert aborted(store.read, 0x0003, 0) == AbortCode.NO_OBJECT
    assert store.dummies == {3: "h"}


def test_access_rules_hold(store):
    assert aborted(store.read, 0x2001, 0) == AbortCode.WRITE_ONLY
    assert aborted(store.write, 0x2003, 0, bytes(8)) == AbortCode.READ_ONLY
    assert aborted(store.read, 0x2000, 1) == AbortCode.NO_SUBINDEX


def test_limits_and_lengths_hold_and_a_refused_value_changes_nothing(store):
    assert aborted(store.write, 0x2000, 0, b"\x0b\x00") == AbortCode.VALUE_TOO_HIGH
    assert aborted(store.write, 0x2000, 0, b"\xf5\xff") == AbortCode.VALUE_TOO_LOW
    assert aborted(store.write, 0x2000, 0, b"\x01") == AbortCode.TOO_SHORT
    assert aborted(store.write, 0x2000, 0, b"\x01\x00\x00\x00") == AbortCode.TOO_LONG
    assert store.get(0x2000) == -3


def test_pdo_directions_follow_the_access_type(store):
    directions = {entry.index: (entry.sendable, entry.receivable) for entry in store}
    assert directions == {
        0x2000: (True, True),
        0x2001: (False, True),
        0x2002: (False, False),
        0x2003: (True, False),
        0x2004: (True, False),
        0x2005: (False, True),
        0x2006: (False, False),  # only whole numbers are mapped
    }


def test_watchers_are_told_of_every_write_and_when_the_device_acts(store):
    told: list[tuple[int, int]] = []
    store.watch(lambda at_ns, effect_ns: told.append((at_ns, effect_ns)), 0x2000)
    store.write(0x2000, 0, b"\x05\x00")
    store.write(0x2000, 0, b"\x05\x00")
    assert told == [(5, 105), (5, 105)]


def test_a_source_is_asked_at_every_read(store):
    store.source(lambda at_ns: 1000 + at_ns, 0x2003)
    assert store.read(0x2003, 0) == (1005).to_bytes(8, "little")


def test_the_length_of_an_object_is_known_unless_it_has_none(store):
    assert store.size_of(0x2000, 0) == 2
    assert store.size_of(0x2002, 0) is None
    assert store.size_of(0x5FFF, 0) is None
