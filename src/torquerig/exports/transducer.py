"""From the transducer of a torque bench to its messages on the bus."""

import canopen

from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.transducer import CHANNEL, TransducerSettings, mapped_objects
from torquerig.driver.wire import cob
from torquerig.driver.wire.dictionary import find_variable, load_dictionary
from torquerig.driver.wire.measuring import DECIMAL_DIGITS, PHYSICAL_UNIT, REAL_PROCESS_VALUE, AiStatus, split_unit
from torquerig.driver.wire.pdo import split_mapping_entry
from torquerig.exports.dbc import Message
from torquerig.exports.objects import Scale, pdo_signals
from torquerig.exports.services import MASTER, node_services

_KNOWN = ", ".join(f"{bit.value}: {(bit.name or '').lower().replace('_', ' ')}" for bit in AiStatus)


def transducer_name(node_id: int) -> str:
    """What a transducer is called as a node of a DBC."""
    return f"Transducer{node_id}"


def transducer_messages(settings: TransducerSettings) -> tuple[Message, ...]:
    """EMCY, SDO, heartbeat and TPDO1 of a transducer, as the driver configures it.

    Args:
        settings: Which transducer, and how it is mounted.

    Raises:
        EdsError: Its EDS cannot be read, or holds no process value.
    """
    name, node_id = transducer_name(settings.node_id), settings.node_id
    dictionary = load_dictionary(settings.eds, node_id)
    objects = DriveObjects(node_id, settings.eds, dictionary, kind="transducer")
    value, *status = mapped_objects(objects, settings.eds)
    entries = objects.layout((value, *status)).mapping
    scales: dict[tuple[int, int], Scale] = {each: Scale(1, "", f"bits {_KNOWN}") for each in status}
    code = _default(dictionary, PHYSICAL_UNIT)
    if code is not None and split_unit(code).is_torque:
        digits = 0 if value.entry == REAL_PROCESS_VALUE else _default(dictionary, DECIMAL_DIGITS) or 0
        factor = settings.sign * 10.0 ** (split_unit(code).prefix - digits)
        scales[value] = Scale(factor, "Nm", "positive as the drive's positive counts")
    length = sum(split_mapping_entry(entry)[2] for entry in entries) // 8
    signals = pdo_signals(dictionary, entries, scales)
    comment = f"TPDO1 of transducer {node_id}, after every SYNC"
    tpdo = Message(cob.TPDO[1] + node_id, f"{name}_TPDO1", length, name, (MASTER,), signals, comment)
    return (*node_services(node_id, name), tpdo)


def _default(dictionary: canopen.ObjectDictionary, index: int) -> int | None:
    variable = find_variable(dictionary, index, CHANNEL)
    return variable.default if variable is not None and isinstance(variable.default, int) else None
