"""Changing what a PDO carries: the procedure of CiA 301, 7.5.2.36 and 7.5.2.38, and its abort codes."""

from __future__ import annotations

import pytest

DISABLE_TPDO1 = """
    > 601#23 00 18 01 81 01 00 80
    < 581#60 00 18 01 00 00 00 00"""
DISABLE_RPDO1 = """
    > 601#23 00 14 01 01 02 00 80
    < 581#60 00 14 01 00 00 00 00"""


def test_a_mapping_cannot_change_while_its_pdo_exists(bench):
    bench.talk("""
        > 601#2F 00 1A 00 00 00 00 00
        < 581#80 00 1A 00 22 00 00 08
        > 601#23 00 1A 01 20 00 64 60
        < 581#80 00 1A 01 22 00 00 08""")


def test_entries_cannot_change_while_their_number_is_not_0(bench):
    bench.talk(f"""{DISABLE_TPDO1}
        > 601#23 00 1A 01 20 00 64 60
        < 581#80 00 1A 01 22 00 00 08""")


def test_a_tpdo_is_remapped_while_the_node_is_operational(operational):
    operational.talk(f"""{DISABLE_TPDO1}
        > 080#
        > 601#2F 00 1A 00 00 00 00 00
        < 581#60 00 1A 00 00 00 00 00
        > 601#23 00 1A 01 08 00 61 60
        < 581#60 00 1A 01 00 00 00 00
        > 601#23 00 1A 02 10 00 41 60
        < 581#60 00 1A 02 00 00 00 00
        > 601#2F 00 1A 00 02 00 00 00
        < 581#60 00 1A 00 00 00 00 00
        > 601#23 00 18 01 90 01 00 00
        < 581#60 00 18 01 00 00 00 00
        > 080#
        < 190#0A 00 00""")


@pytest.mark.parametrize(
    ("entry", "abort"),
    [
        ("20 00 00 10", "41 00 04 06"),  # 1000: the EDS does not allow it
        ("10 00 64 60", "41 00 04 06"),  # 6064 has 32 bits, not 16
        ("10 00 03 00", "41 00 04 06"),  # a dummy: for RPDOs only
        ("10 00 FF 5F", "00 00 02 06"),  # no such object
        ("10 05 00 21", "00 00 02 06"),  # no such sub-index
    ],
)
def test_what_a_tpdo_cannot_carry_is_refused(bench, entry, abort):
    bench.talk(f"""{DISABLE_TPDO1}
        > 601#2F 00 1A 00 00 00 00 00
        < 581#60 00 1A 00 00 00 00 00
        > 601#23 00 1A 01 {entry}
        < 581#80 00 1A 01 {abort}""")


def test_a_read_only_object_cannot_be_received(bench):
    bench.talk(f"""{DISABLE_RPDO1}
        > 601#2F 00 16 00 00 00 00 00
        < 581#60 00 16 00 00 00 00 00
        > 601#23 00 16 01 10 00 41 60
        < 581#80 00 16 01 41 00 04 06""")


def test_more_than_eight_bytes_are_refused_when_their_number_is_written(bench):
    bench.talk(f"""{DISABLE_RPDO1}
        > 601#2F 00 16 00 00 00 00 00
        < 581#60 00 16 00 00 00 00 00
        > 601#23 00 16 01 20 00 04 00
        < 581#60 00 16 01 00 00 00 00
        > 601#23 00 16 02 20 00 04 00
        < 581#60 00 16 02 00 00 00 00
        > 601#23 00 16 03 08 00 05 00
        < 581#60 00 16 03 00 00 00 00
        > 601#2F 00 16 00 03 00 00 00
        < 581#80 00 16 00 42 00 04 06
        > 601#2F 00 16 00 02 00 00 00
        < 581#60 00 16 00 00 00 00 00""")


def test_an_entry_that_was_never_written_cannot_be_counted(bench):
    bench.talk(f"""{DISABLE_TPDO1}
        > 601#2F 00 1A 00 04 00 00 00
        < 581#80 00 1A 00 00 00 02 06""")


def test_a_pdo_without_objects_cannot_be_made_valid(bench):
    bench.talk(f"""{DISABLE_TPDO1}
        > 601#2F 00 1A 00 00 00 00 00
        < 581#60 00 1A 00 00 00 00 00
        > 601#23 00 18 01 81 01 00 00
        < 581#80 00 18 01 30 00 09 06""")


@pytest.mark.parametrize(
    "cob_id",
    [
        "82 01 00 00",  # another identifier while the PDO exists
        "81 01 00 20",  # 29-bit identifiers
    ],
)
def test_the_cob_id_of_an_existing_pdo_keeps_its_identifier(bench, cob_id):
    bench.talk(f"""
        > 601#23 00 18 01 {cob_id}
        < 581#80 00 18 01 30 00 09 06""")


@pytest.mark.parametrize("cob_id", ["00 00", "01 00", "01 01", "80 01", "81 05", "01 06", "E0 06", "01 07", "80 07"])
def test_restricted_identifiers_are_refused(bench, cob_id):
    bench.talk(f"""{DISABLE_TPDO1}
        > 601#23 00 18 01 {cob_id} 00 00
        < 581#80 00 18 01 30 00 09 06""")


def test_one_rpdo_serves_several_drives_by_dummies_for_the_others_slots(operational):
    """Three torques on COB-ID 0x200; this node takes the second (CiA 301, 7.4.7.1: dummy entries)."""
    operational.talk(f"""{DISABLE_RPDO1}
        > 601#2F 00 16 00 00 00 00 00
        < 581#60 00 16 00 00 00 00 00
        > 601#23 00 16 01 10 00 03 00
        < 581#60 00 16 01 00 00 00 00
        > 601#23 00 16 02 10 00 71 20
        < 581#60 00 16 02 00 00 00 00
        > 601#23 00 16 03 10 00 03 00
        < 581#60 00 16 03 00 00 00 00
        > 601#2F 00 16 00 03 00 00 00
        < 581#60 00 16 00 00 00 00 00
        > 601#23 00 14 01 00 02 00 00
        < 581#60 00 14 01 00 00 00 00
        > 200#11 11 22 22 33 33
        > 601#40 71 20 00 00 00 00 00
        < 581#4B 71 20 00 22 22 00 00""")


def test_two_rpdos_on_one_identifier_both_hear_it(operational):
    operational.talk("""
        > 601#23 01 16 01 10 00 B2 60
        < 581#60 01 16 01 00 00 00 00
        > 601#2F 01 16 00 01 00 00 00
        < 581#60 01 16 00 00 00 00 00
        > 601#23 01 14 01 01 02 00 00
        < 581#60 01 14 01 00 00 00 00
        > 201#06 00 34 12
        < 081#20 82 11 00 00 00 00 00
        > 601#40 71 20 00 00 00 00 00
        < 581#4B 71 20 00 34 12 00 00
        > 601#40 B2 60 00 00 00 00 00
        < 581#4B B2 60 00 06 00 00 00""")
