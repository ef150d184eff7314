"""The pre-defined connection set (CiA 301, 7.3.5) and the bits of COB-ID entries."""

import pytest

from torquerig.driver.wire import cob


def test_the_connection_set_is_the_standards():
    assert (cob.NMT, cob.SYNC, cob.EMCY) == (0x000, 0x080, 0x080)
    assert dict(cob.TPDO) == {1: 0x180, 2: 0x280, 3: 0x380, 4: 0x480}
    assert dict(cob.RPDO) == {1: 0x200, 2: 0x300, 3: 0x400, 4: 0x500}
    assert (cob.SDO_RESPONSE, cob.SDO_REQUEST, cob.HEARTBEAT) == (0x580, 0x600, 0x700)


@pytest.mark.parametrize("can_id", [0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x701, 0x7FF])
def test_identifiers_that_the_standard_reserves_are_restricted(can_id):
    assert cob.is_restricted(can_id)


@pytest.mark.parametrize("can_id", [0x080, 0x081, 0x0FF, 0x100, 0x181, 0x200, 0x57F, 0x580, 0x600, 0x680, 0x6DF, 0x700])
def test_identifiers_that_may_be_configured_are_not_restricted(can_id):
    assert not cob.is_restricted(can_id)


def test_a_cob_id_entry_tells_validity_and_identifier():
    assert cob.is_valid(0x40000181)
    assert not cob.is_valid(0x80000201)
    assert cob.identifier(0x80000201) == 0x201


@pytest.mark.parametrize("node_id", [-1, 0, 128])
def test_a_node_id_outside_1_to_127_is_refused(node_id):
    with pytest.raises(ValueError, match=f"not {node_id}"):
        cob.check_node_id(node_id)


def test_a_good_node_id_comes_back():
    assert [cob.check_node_id(n) for n in (1, 127)] == [1, 127]
