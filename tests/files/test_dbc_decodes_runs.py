"""The exported DBC, judged by cantools: it decodes a recorded run to the numbers of its table."""

import logging
from collections import defaultdict

import cantools.database
import numpy as np
import pyarrow.parquet as pq
import pytest

from torquerig.axes import axis_settings
from torquerig.configuration import load_configuration
from torquerig.exports.dbc import dbc_text
from torquerig.exports.drives import PdoSource, rig_messages
from torquerig.record import BUS_FILE, CYCLES_FILE

HALF_COUNT_NM = 0.5 / 20100  # a command is rounded to whole counts


def text_of(configuration, source=PdoSource.DRIVER):
    return dbc_text(rig_messages(axis_settings(configuration), configuration.rig.master.node_id, source))


def load(text):
    return cantools.database.load_string(text, "dbc", strict=True)


@pytest.fixture(scope="module")
def database():
    return load(text_of(load_configuration()))


@pytest.fixture(scope="module")
def decoded(database, record, read_log):
    """Return every frame of the run in the order of the wire: the name of its message, and its signals."""
    return [
        (
            database.get_message_by_frame_id(each.arbitration_id).name,
            database.decode_message(each.arbitration_id, each.data),
        )
        for each in read_log(record / BUS_FILE)
    ]


@pytest.fixture(scope="module")
def by_name(decoded):
    frames = defaultdict(list)
    for name, signals in decoded:
        frames[name].append(signals)
    return frames


@pytest.fixture(scope="module")
def cycles(record):
    table = pq.read_table(record / CYCLES_FILE)
    return {name: table[name].to_numpy() for name in table.column_names}


@pytest.fixture(scope="module")
def rows(decoded, cycles):
    """Return what was on the bus from SYNC to SYNC, for the SYNCs that belong to the table's rows.

    There is one place only where all positions agree.
    """
    periods = []
    for name, signals in decoded:
        if name == "SYNC":
            periods.append({})
        elif periods:
            periods[-1].setdefault(name, signals)  # what ends the run follows in the last row's period
    count = len(cycles["q_1"])
    positions = {leg: column(periods, f"Drive{leg}_TPDO1", "Position_actual_value") for leg in (1, 2, 3)}
    places = [
        k
        for k in range(len(periods) - count + 1)
        if all((positions[leg][k : k + count] == cycles[f"q_{leg}"]).all() for leg in (1, 2, 3))
    ]
    assert len(places) == 1
    return periods[places[0] : places[0] + count]


def column(rows, message, signal):
    return np.array([row[message][signal] for row in rows], dtype=float)


def test_cantools_loads_the_dbc_without_a_complaint(caplog):
    caplog.set_level(logging.WARNING)
    database = load(text_of(load_configuration()))
    assert caplog.records == []
    assert {node.name for node in database.nodes} == {"Master", "Drive1", "Drive2", "Drive3"}
    assert len(database.messages) == 3 + 3 * 7


def test_every_frame_of_the_run_has_its_message(by_name):
    kinds = {name.partition("_")[2] for name in by_name if name.startswith("Drive")}
    assert kinds == {"SDO_request", "SDO_response", "heartbeat", "TPDO1", "TPDO2", "RPDO1"}
    assert len(by_name["SYNC"]) == len(by_name["Drive1_TPDO1"]) == len(by_name["Drive3_TPDO1"])


@pytest.mark.parametrize("leg", [1, 2, 3])
def test_positions_are_the_tables(rows, cycles, leg):
    angles = column(rows, f"Drive{leg}_TPDO1", "Position_actual_value")
    assert np.ptp(angles) > 0.001  # [rad], 32 counts: the machine moved
    np.testing.assert_array_equal(angles, cycles[f"q_{leg}"])


@pytest.mark.parametrize("leg", [1, 2, 3])
def test_actual_torques_are_the_tables(rows, cycles, leg):
    torques = column(rows, f"Drive{leg}_TPDO1", "Raw_torque_actual")
    assert np.ptp(torques) > 0.1  # [N·m]
    np.testing.assert_array_max_ulp(torques, cycles[f"tau_actual_{leg}"], maxulp=1)


@pytest.mark.parametrize("leg", [1, 2, 3])
def test_target_torques_are_the_tables_to_half_a_count(rows, cycles, leg):
    torques = column(rows, f"Drive{leg}_RPDO1", "Raw_torque_target")
    assert np.abs(torques - cycles[f"tau_{leg}"]).max() <= HALF_COUNT_NM * (1 + 1e-9)


def test_states_and_commands_are_words(by_name):
    states = [str(frame["Drive_state"]) for frame in by_name["Drive1_TPDO1"]]
    walk = [state for state, before in zip(states, [None, *states], strict=False) if state != before]
    assert "operation enabled" in walk
    assert walk[-1] == "switch on disabled"
    assert {str(frame["Command"]) for frame in by_name["Drive1_RPDO1"]} >= {"disable voltage", "enable operation"}
    assert {str(frame["NMT_state"]) for frame in by_name["Drive2_heartbeat"]} >= {"boot-up", "operational"}
    assert {str(frame["Command"]) for frame in by_name["NMT"]} >= {"start"}


def test_sdo_tells_objects_and_values(by_name):
    pairs = list(zip(by_name["Drive2_SDO_request"], by_name["Drive2_SDO_response"], strict=True))
    writes = {
        (request["Index"], request["Subindex"]): request["Data"]
        for request, response in pairs
        if str(request["Specifier"]) == str(response["Specifier"]) == "initiate download"
    }
    assert writes[0x6060, 0] == 10
    assert writes[0x1006, 0] == 4000
    assert all(request["Index"] == response["Index"] for request, response in pairs)


def test_emergencies_are_words(database, deserted_log, read_log):
    told = defaultdict(list)
    for message in read_log(deserted_log):
        if 0x81 <= message.arbitration_id <= 0x83:
            signals = database.decode_message(message.arbitration_id, message.data)
            told[message.arbitration_id].append(str(signals["Error_code"]))
    assert set(told) == {0x81, 0x82, 0x83}
    assert "SYNC lost" in {codes[0] for codes in told.values()}


def test_temperature_and_velocity_have_units(database, by_name):
    temperatures = np.array([each["Drive_temperature"] for each in by_name["Drive1_TPDO2"]])
    assert database.get_message_by_name("Drive1_TPDO2").get_signal_by_name("Drive_temperature").unit == "degC"
    assert temperatures == pytest.approx(30)
    assert (
        max(abs(each["Velocity_actual_value"]) for each in by_name["Drive1_TPDO2"]) < 18.8
    )  # [rad/s] 4500 rpm over 25
    assert str(by_name["Drive1_TPDO2"][0]["Error_code"]) == "no error, or the error is gone"


def test_the_eds_maps_what_the_driver_maps():
    shipped = load(text_of(load_configuration(), PdoSource.EDS))
    configured = load(text_of(load_configuration(), PdoSource.DRIVER))
    assert shipped.as_dbc_string() == configured.as_dbc_string()
