"""Drive profiles: what is shipped loads, and what a file holds wrongly is named with file and key."""

from __future__ import annotations

from pathlib import Path

import pytest

from torquerig.driver.errors import ProfileError
from torquerig.driver.master.profile import ObjectAddress, load_profile, parse_address, shipped_profiles
from torquerig.driver.wire.dictionary import DRIVE_EDS

WHOLE = """
name = "mine"
[torque]
reference = "rated torque"
target = "6071"
actual = "6077"
rated_object = "6076"
rated_unit = 0.001
[rpdo]
number = 1
objects = ["6040", "6071"]
[[tpdos]]
number = 1
objects = ["6041", "6064", "6077"]
[watchdogs]
rpdo_timer = true
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", shipped_profiles())
def test_every_shipped_profile_loads_under_its_own_name(name):
    assert load_profile(name).name == name


def test_the_default_profile_is_our_drive_with_raw_counts_and_its_eds():
    profile = load_profile()
    assert profile.torque.target == (0x2071, 0)
    assert profile.torque.counts_per_nm == 20100
    assert profile.homed_bit == 8
    assert profile.eds is not None
    assert profile.eds.samefile(DRIVE_EDS)


def test_a_file_of_ones_own_is_a_profile(tmp_path):
    profile = load_profile(written(tmp_path, WHOLE))
    assert profile.torque.rated_object == (0x6076, 0)
    assert profile.mode == 10
    assert profile.eds is None


def test_an_eds_given_by_the_caller_wins(tmp_path):
    assert load_profile("torquerig", eds=tmp_path / "other.eds").eds == tmp_path / "other.eds"


def test_an_eds_beside_the_file_is_found(tmp_path):
    (tmp_path / "drive.eds").touch()
    profile = load_profile(written(tmp_path, 'eds = "drive.eds"\n' + WHOLE))
    assert profile.eds == tmp_path / "drive.eds"


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("colour = 1\n" + WHOLE, "colour is no key"),
        (WHOLE + 'colour = "red"', "watchdogs.colour is no key"),
        (WHOLE.replace('name = "mine"', ""), "name is missing"),
        ("mode = 8\n" + WHOLE, "mode: Input should be 4 or 10"),
        ("homed_bit = 16\n" + WHOLE, "homed_bit"),
        (WHOLE.replace('"6071"]', '"6072"]'), "rpdo does not map 6071:0"),
        (WHOLE.replace('"6064", ', ""), "tpdos.0 does not map 6064:0"),
        (WHOLE.replace("rpdo_timer = true", ""), "name a watchdog"),
        (WHOLE.replace("rpdo_timer = true", "heartbeat = true\nguarding = true"), "never both"),
        (WHOLE.replace('"6076"', '"rated"'), "torque.rated_object: 'rated' is no object"),
        (WHOLE.replace("rated_unit = 0.001", ""), "need rated_object and rated_unit"),
        (WHOLE.replace('"rated torque"', '"counts"'), "needs counts_per_nm"),
        ("name = ", "is no TOML"),
    ],
)
def test_a_wrong_profile_is_refused_naming_file_and_key(tmp_path, text, complaint):
    path = written(tmp_path, text)
    with pytest.raises(ProfileError) as refusal:
        load_profile(path)
    assert str(path) in str(refusal.value)
    assert complaint in str(refusal.value)
    assert "\n" not in str(refusal.value).strip()


def test_an_unknown_name_is_told_which_there_are():
    with pytest.raises(ProfileError, match="no drive profile 'torqerig': choose elmo, nanotec, torquerig"):
        load_profile("torqerig")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ProfileError, match=r"nowhere\.toml cannot be read"):
        load_profile(tmp_path / "nowhere.toml")


@pytest.mark.parametrize("text", ["2071", "0x2071", "2071:0", "0x2071:0x0"])
def test_an_address_is_hexadecimal_with_or_without_prefix(text):
    assert parse_address(text) == (0x2071, 0)


@pytest.mark.parametrize("text", ["", "12345", "6040:100", "controlword", "0", "60.40"])
def test_what_is_no_address_is_refused(text):
    with pytest.raises(ValueError, match="is no object"):
        parse_address(text)


def test_an_address_reads_back_from_its_own_words():
    address = ObjectAddress(0x1A00, 0x0B)
    assert parse_address(str(address)) == address
