"""What a DBC says of drives that are not like ours, and what cantools makes of it."""

import math
from dataclasses import replace
from pathlib import Path

import canopen
import cantools.database
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from dcf.device import Device

from torquerig.driver.errors import EdsError
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.wire.dictionary import DRIVE_EDS
from torquerig.exports.dbc import Message, Signal, dbc_text
from torquerig.exports.drives import PdoSource, rig_messages
from torquerig.exports.objects import Scale, identifier, pdo_signals

OURS = load_profile()
MASTER_ID = 127


def dictionary_of(**variables):
    """Return a dictionary with objects 4000, 4001 ... of these names and data types."""
    dictionary = canopen.ObjectDictionary()
    for offset, (name, data_type) in enumerate(variables.items()):
        variable = ODVariable(name.replace("_", " "), 0x4000 + offset)
        variable.data_type = data_type
        dictionary.add_object(variable)
    return dictionary


def load(messages):
    return cantools.database.load_string(dbc_text(messages), "dbc", strict=True)


def tpdo1(settings, source=PdoSource.DRIVER):
    return load(rig_messages([settings], MASTER_ID, source)).get_message_by_name(f"Drive{settings.node_id}_TPDO1")


def edited(tmp_path, *changes):
    """Return our EDS with some of its text changed."""
    text = DRIVE_EDS.read_text("ascii")
    for before, after in changes:
        assert before in text
        text = text.replace(before, after, 1)
    eds = tmp_path / "drive.eds"
    eds.write_text(text, "ascii")
    return eds


# statusword 0x1737: operation enabled, voltage, bits 8, 9, 10 and 12; position -100000 counts, half a joint revolution
# backwards; torque -2010 counts
GOLDEN = bytes.fromhex("3717 6079feff 26f8")


def test_a_golden_frame_means_what_the_drives_description_says():
    signals = tpdo1(AxisSettings(5, OURS)).decode(GOLDEN)
    assert str(signals.pop("Drive_state")) == "operation enabled"
    assert signals.pop("Position_actual_value") == pytest.approx(-math.pi, rel=1e-15)
    assert signals.pop("Raw_torque_actual") == pytest.approx(-0.1, rel=1e-15)
    assert {name for name, value in signals.items() if value} == {"Homed", "Remote", "Target_reached", "Target_used"}


def test_an_axis_that_counts_backwards_has_negative_factors():
    message = tpdo1(AxisSettings(5, OURS, sign=-1))
    signals = message.decode(GOLDEN)
    assert signals["Position_actual_value"] == pytest.approx(math.pi, rel=1e-15)
    assert signals["Raw_torque_actual"] == pytest.approx(0.1, rel=1e-15)
    position = message.get_signal_by_name("Position_actual_value")
    assert position.minimum < 0 < position.maximum


def test_a_torque_with_two_slopes_stays_in_counts_and_says_so():
    settings = AxisSettings(5, OURS, counts_per_nm_positive=20670.0, counts_per_nm_negative=19528.0)
    message = tpdo1(settings)
    signal = message.get_signal_by_name("Raw_torque_actual")
    assert (signal.unit, message.decode(GOLDEN)["Raw_torque_actual"]) == ("counts", -2010)
    assert "20670.0 above 0, 19528.0 below" in signal.comment


@pytest.mark.parametrize(("rated", "unit", "value"), [(None, "%", -201.0), (500, "Nm", -1.005)])
def test_per_mille_become_torque_where_the_rated_torque_is_known(rated, unit, value, tmp_path):
    eds = edited(tmp_path, ("ParameterName=Motor rated torque", "ParameterName=Rated"), ("=319", "=0"))
    profile = replace(load_profile("elmo", eds=eds), counts_per_revolution=8000)
    settings = AxisSettings(5, replace(profile, torque=replace(profile.torque, rated_value=rated)))
    message = tpdo1(settings)
    signal = message.get_signal_by_name("Torque_actual_value")
    assert signal.unit == unit
    assert message.decode(GOLDEN)["Torque_actual_value"] == pytest.approx(value)


def test_a_rated_torque_of_the_eds_is_taken():
    profile = replace(load_profile("elmo", eds=DRIVE_EDS), counts_per_revolution=8000)
    message = tpdo1(AxisSettings(5, profile))
    assert message.decode(GOLDEN)["Torque_actual_value"] == pytest.approx(-2.010 * 0.319)


def test_the_pdos_of_an_eds_are_those_that_dcf_tools_reads():
    device = Device.from_dcf(str(DRIVE_EDS), {"NODEID": 9})
    read = {}
    for kind, pdos in (("RPDO", device.rpdo), ("TPDO", device.tpdo)):
        for number, pdo in pdos.items():
            if not pdo.cob_id >> 31:
                lengths = [each.data_type.bits() for each in pdo.mapping.values()]
                read[f"Drive9_{kind}{number}"] = (pdo.cob_id & 0x7FF, sum(lengths) // 8)
    messages = rig_messages([AxisSettings(9, OURS)], MASTER_ID, PdoSource.EDS)
    ours = {each.name: (each.can_id, each.length) for each in messages if "PDO" in each.name}
    assert ours == read
    assert set(ours) == {"Drive9_RPDO1", "Drive9_TPDO1", "Drive9_TPDO2"}


def test_fillers_leave_their_place_empty():
    dictionary = dictionary_of(load=datatypes.INTEGER16)
    signals = pdo_signals(dictionary, [0x00030010, 0x40000010, 0x00050008], {})
    assert [(each.name, each.start, each.length) for each in signals] == [("load", 16, 16)]
    message = load([Message(0x200, "Group", 5, "Master", signals=signals)]).get_message_by_name("Group")
    assert message.decode(b"\xff\xff\xfe\xff\xff") == {"load": -2}


def test_every_numeric_type_decodes_as_itself():
    types = {
        "flag": (datatypes.BOOLEAN, 8, b"\x01", 1),
        "small": (datatypes.INTEGER8, 8, b"\xff", -1),
        "three": (datatypes.UNSIGNED24, 24, b"\x01\x02\xff", 0xFF0201),
        "odd": (datatypes.INTEGER40, 40, b"\xfe\xff\xff\xff\xff", -2),
        "single": (datatypes.REAL32, 32, b"\x00\x00\xc0\x3f", 1.5),
        "double": (datatypes.REAL64, 64, b"\x00\x00\x00\x00\x00\x00\xf8\xbf", -1.5),
        "long": (datatypes.UNSIGNED64, 64, b"\xff" * 8, 2**64 - 1),
    }
    dictionary = dictionary_of(**{name: data_type for name, (data_type, *_) in types.items()})
    for offset, (name, (_, bits, data, value)) in enumerate(types.items()):
        signals = pdo_signals(dictionary, [(0x4000 + offset) << 16 | bits], {})
        message = load([Message(0x180, "One", bits // 8, "Drive1", signals=signals)]).get_message_by_name("One")
        assert message.decode(data) == {name: value}


def test_one_object_mapped_twice_has_two_names():
    dictionary = dictionary_of(A_very_long_name_of_an_object_indeed=datatypes.INTEGER16)
    names = [each.name for each in pdo_signals(dictionary, [0x40000010] * 3, {})]
    assert names == [
        "A_very_long_name_of_an_object_in",
        "A_very_long_name_of_an_object__2",
        "A_very_long_name_of_an_object__3",
    ]
    assert {len(name) for name in names} == {32}


@pytest.mark.parametrize(
    ("words", "name"), [("I²t load (%)", "I_t_load"), ("2nd torque", "_2nd_torque"), ("", "_"), ("a" * 40, "a" * 32)]
)
def test_names_are_identifiers(words, name):
    assert identifier(words) == name


def test_words_that_are_not_ascii_or_quoted_do_no_harm():
    signal = Signal("Heat", 0, 8, unit="°C", comment='the "inner" one \\ µ', choices={1: 'the "1"'})
    message = load([Message(1, "A", 1, "B", signals=(signal,), comment='"')]).get_message_by_name("A")
    assert message.comment == "'"
    assert message.get_signal_by_name("Heat").comment == "the 'inner' one / ?"


def test_limits_of_the_eds_are_scaled():
    dictionary = dictionary_of(limit=datatypes.INTEGER16)
    dictionary[0x4000].min, dictionary[0x4000].max = -5, 10
    (signal,) = pdo_signals(dictionary, [0x40000010], {(0x4000, 0): Scale(-2.0, "V")})
    assert signal.limits == (-20.0, 10.0)


def test_an_identifier_of_29_bits_is_told(tmp_path):
    eds = edited(tmp_path, ("$NODEID+0x00000180", "0x32345678"))
    message = tpdo1(AxisSettings(5, OURS, eds=eds), PdoSource.EDS)
    assert (message.frame_id, message.is_extended_frame) == (0x12345678, True)


def test_two_messages_with_one_identifier_are_refused(tmp_path):
    eds = edited(tmp_path, ("$NODEID+0x00000180", "0x00000181"))
    axes = [AxisSettings(node_id, OURS, eds=eds) for node_id in (1, 2)]
    with pytest.raises(EdsError, match="Drive1_TPDO1 and Drive2_TPDO1 have the same identifier 0x181"):
        rig_messages(axes, MASTER_ID, PdoSource.EDS)
    with pytest.raises(ValueError, match="are the same"):
        dbc_text([Message(1, "A", 0, "B"), Message(2, "A", 0, "B")])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            ("DefaultValue=0x60640020", "DefaultValue=0x60650020"),
            "drive 5: object 6065:0 is mapped, but the EDS does not hold it",
        ),
        (("DefaultValue=0x60640020", "DefaultValue=0x10080020"), "1008:0 .* but it is no number"),
        (("DefaultValue=0x60640020", "DefaultValue="), "drive 5: the EDS does not say what 1A00:2 maps into TPDO1"),
    ],
)
def test_an_eds_that_maps_what_it_has_not_is_refused(tmp_path, change, words):
    eds = edited(tmp_path, change)
    with pytest.raises(EdsError, match=words):
        rig_messages([AxisSettings(5, OURS, eds=eds)], MASTER_ID, PdoSource.EDS)


def test_a_profile_that_maps_what_the_eds_has_not_is_refused():
    tpdos = (OURS.tpdos[0], replace(OURS.tpdos[1], objects=("5FFF",)))
    with pytest.raises(EdsError, match="drive 5: object 5FFF:0 is to be mapped, but the EDS does not hold it"):
        rig_messages([AxisSettings(5, replace(OURS, tpdos=tpdos))], MASTER_ID)


def test_an_eds_that_is_not_there_is_named():
    with pytest.raises(EdsError, match=r"nowhere\.eds"):
        rig_messages([AxisSettings(5, OURS, eds=Path("nowhere.eds"))], MASTER_ID)
