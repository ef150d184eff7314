"""The shipped EDS as a file of CiA 306: its lists, counts and keys."""

import re
from configparser import RawConfigParser

import pytest

from torquerig.driver.wire.dictionary import DRIVE_EDS

KEYS = {
    *("ParameterName", "ObjectType", "DataType", "AccessType", "DefaultValue", "LowLimit", "HighLimit"),
    *("PDOMapping", "SubNumber"),
}
LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")


@pytest.fixture(scope="module")
def eds():
    parser = RawConfigParser()
    parser.optionxform = str
    parser.read_string(DRIVE_EDS.read_text("ascii"))
    return parser


def listed(eds, name):
    count = int(eds[name]["SupportedObjects"])
    assert len(eds[name]) == count + 1
    return [int(eds[name][str(n)], 16) for n in range(1, count + 1)]


def test_the_lists_hold_every_object_once_in_its_place(eds):
    mandatory, optional, manufacturer = (listed(eds, name) for name in LISTS)
    sections = [int(section, 16) for section in eds.sections() if re.fullmatch("[0-9A-F]{4}", section)]
    assert sorted(mandatory + optional + manufacturer) == sorted(sections)
    assert mandatory == [0x1000, 0x1001, 0x1018]
    assert all(0x2000 <= index < 0x6000 for index in manufacturer)
    assert not any(0x2000 <= index < 0x6000 for index in optional)
    for indices in (mandatory, optional, manufacturer):
        assert indices == sorted(set(indices))


def test_sub_numbers_count_the_sub_objects(eds):
    for section in eds.sections():
        if re.fullmatch("[0-9A-F]{4}", section):
            subs = [other for other in eds.sections() if other.startswith(section + "sub")]
            assert int(eds[section].get("SubNumber", "0")) == len(subs)
            assert (eds[section]["ObjectType"] == "0x7") == (not subs)


def test_sub_index_0_tells_the_highest_one(eds):
    for section in eds.sections():
        match = re.fullmatch("([0-9A-F]{4})sub0", section)
        is_count_of_something = match and (match[1] == "1003" or match[1][:2] in {"16", "1A"})
        if match and not is_count_of_something:
            subs = [int(other[7:], 16) for other in eds.sections() if other.startswith(match[1] + "sub")]
            assert int(eds[section]["DefaultValue"]) == max(subs)


def test_objects_have_the_keys_of_the_standard_and_no_others(eds):
    for section in eds.sections():
        if re.fullmatch("[0-9A-F]{4}(sub[0-9A-F])?", section):
            assert set(eds[section]) <= KEYS
            if "SubNumber" not in eds[section]:
                assert {"ParameterName", "ObjectType", "DataType", "AccessType", "PDOMapping"} <= set(eds[section])


def test_file_and_device_sections_are_complete(eds):
    assert eds["FileInfo"]["FileName"] == DRIVE_EDS.name
    rates = {int(key[9:]): value for key, value in eds["DeviceInfo"].items() if key.startswith("BaudRate_")}
    assert set(rates) == {10, 20, 50, 125, 250, 500, 800, 1000}
    assert eds["DeviceInfo"]["Granularity"] == "8"
    assert {f"Dummy{n:04d}" for n in range(1, 8)} == set(eds["DummyUsage"])
    assert eds["DummyUsage"]["Dummy0003"] == "1"
    assert int(eds["Comments"]["Lines"]) == len(eds["Comments"]) - 1


def test_cob_ids_depend_on_the_node_id(eds):
    for section in ("1014", "1200sub1", "1200sub2", *(f"{base}{n}sub1" for base in ("140", "180") for n in range(4))):
        assert eds[section]["DefaultValue"].startswith("$NODEID+")
