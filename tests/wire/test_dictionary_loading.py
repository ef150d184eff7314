"""Loading object dictionaries out of EDS files."""

import pytest

from torquerig.driver.errors import EdsError
from torquerig.driver.wire.dictionary import DRIVE_EDS, find_variable, load_dictionary, struct_code


def test_defaults_follow_the_node_id():
    first, third = (load_dictionary(DRIVE_EDS, node_id) for node_id in (1, 3))
    assert find_variable(first, 0x1400, 1).default == 0x201
    assert find_variable(third, 0x1400, 1).default == 0x203


def test_only_what_the_file_holds_is_found():
    dictionary = load_dictionary(DRIVE_EDS, 1)
    assert find_variable(dictionary, 0x1016, 3).index == 0x1016
    assert find_variable(dictionary, 0x1016, 4) is None  # canopen would make one up
    assert find_variable(dictionary, 0x6041).index == 0x6041
    assert find_variable(dictionary, 0x6041, 1) is None
    assert find_variable(dictionary, 0x2F00) is None


@pytest.mark.parametrize(
    ("index", "subindex", "code"),
    [
        (0x6060, 0, "b"),
        (0x6071, 0, "h"),
        (0x6064, 0, "i"),
        (0x2070, 0, "B"),
        (0x6041, 0, "H"),
        (0x6502, 0, "I"),
        (0x2130, 0, "Q"),
    ],
)
def test_data_types_have_their_letter(index, subindex, code):
    assert struct_code(find_variable(load_dictionary(DRIVE_EDS, 1), index, subindex)) == code


def test_a_string_has_no_letter():
    with pytest.raises(EdsError, match="1008:0"):
        struct_code(find_variable(load_dictionary(DRIVE_EDS, 1), 0x1008))


def test_a_missing_file_is_one_sentence(tmp_path):
    with pytest.raises(EdsError, match=r"^the EDS .*nothing.eds cannot be read: No such file or directory$"):
        load_dictionary(tmp_path / "nothing.eds", 1)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no section\n",
        "[FileInfo]\nFileName=x\n",
        "[DeviceInfo]\n",
        "[DeviceInfo]\n[1000]\nObjectType=0x7\n",
        "[DeviceInfo]\n[1000]\nParameterName=x\nObjectType=seven\n",
        "[DeviceInfo]\n[1000sub1]\nParameterName=x\nDataType=7\nAccessType=ro\n",
        "[DeviceInfo]\n[Comments]\nLines=2\nLine1=x\n",
    ],
)
def test_a_file_that_is_no_eds_is_one_sentence(tmp_path, text):
    path = tmp_path / "bad.eds"
    path.write_text(text)
    with pytest.raises(EdsError, match="is no EDS") as caught:
        load_dictionary(path, 1)
    assert "\n" not in str(caught.value)


def test_binary_rubbish_is_one_sentence(tmp_path):
    path = tmp_path / "rubbish.eds"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(EdsError, match="is no EDS"):
        load_dictionary(path, 1)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_makers_encodings_are_read(tmp_path, encoding):
    path = tmp_path / "maker.eds"
    name = "[DeviceInfo]\n[2000]\nParameterName=Temperature °C\nDataType=6\nAccessType=ro\n"
    path.write_bytes(name.encode(encoding))
    assert find_variable(load_dictionary(path, 1), 0x2000).name == "Temperature °C"


def test_another_kind_of_file_is_one_sentence(tmp_path):
    path = tmp_path / "drive.xml"
    path.write_text("<xml/>")
    with pytest.raises(EdsError, match="is no EDS"):
        load_dictionary(path, 1)


@pytest.mark.parametrize("node_id", [0, 128])
def test_a_node_id_out_of_range_is_refused(node_id):
    with pytest.raises(ValueError, match=str(node_id)):
        load_dictionary(DRIVE_EDS, node_id)
