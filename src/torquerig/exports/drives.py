"""From the axes of a rig to the messages on its bus."""

from collections.abc import Iterator, Sequence
from enum import StrEnum

from torquerig.driver.errors import EdsError
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.transducer import TransducerSettings
from torquerig.driver.wire import cob
from torquerig.driver.wire.dictionary import load_dictionary
from torquerig.driver.wire.pdo import split_mapping_entry
from torquerig.exports.dbc import Message
from torquerig.exports.objects import pdo_signals
from torquerig.exports.pdos import configured_pdos, shipped_pdos
from torquerig.exports.scales import scales_of
from torquerig.exports.services import MASTER, common_messages, drive_name, drive_services, heartbeat_message
from torquerig.exports.transducer import transducer_messages, transducer_name


class PdoSource(StrEnum):
    """Whose PDOs are meant: those that the driver configures, or those that the EDS ships."""

    DRIVER = "driver"
    EDS = "eds"


def rig_messages(
    axes: Sequence[AxisSettings],
    master_id: int,
    source: PdoSource = PdoSource.DRIVER,
    transducer: TransducerSettings | None = None,
) -> tuple[Message, ...]:
    """All messages on the bus of a rig.

    Args:
        axes: The drives.
        master_id: Node-id of the driver's own heartbeat.
        source: Whose PDOs.
        transducer: That of a torque bench on the same bus.

    Returns:
        NMT, SYNC, the master's heartbeat, then each drive's messages, then the transducer's.

    Raises:
        EdsError: An EDS cannot be read, or does not hold what is mapped; or two messages have one identifier.
        ProfileError: A profile does not say enough.
    """
    names = [drive_name(axis.node_id) for axis in axes]
    beside = [] if transducer is None else [transducer_name(transducer.node_id)]
    messages = [*common_messages([*names, *beside]), heartbeat_message(master_id, MASTER, names)]
    for axis, name in zip(axes, names, strict=True):
        messages += drive_services(axis.node_id, [other for other in names if other != name])
        try:
            messages += _pdo_messages(axis, source)
        except EdsError as error:
            raise EdsError(f"drive {axis.node_id}: {error}") from error
    if transducer is not None:
        messages += transducer_messages(transducer)
    _refuse_shared(messages)
    return tuple(messages)


def _pdo_messages(axis: AxisSettings, source: PdoSource) -> Iterator[Message]:
    dictionary = load_dictionary(axis.eds_path, axis.node_id)
    pdos = configured_pdos(axis, dictionary) if source is PdoSource.DRIVER else shipped_pdos(dictionary)
    scales = scales_of(axis, dictionary)
    drive = drive_name(axis.node_id)
    for pdo in pdos:
        bits = sum(split_mapping_entry(entry)[2] for entry in pdo.entries)
        extended = bool(pdo.cob_id & cob.EXTENDED)
        yield Message(
            can_id=pdo.cob_id & (cob.EXTENDED - 1) if extended else cob.identifier(pdo.cob_id),
            name=f"{drive}_{pdo.name}",
            length=-(-bits // 8),
            sender=drive if pdo.is_sent else MASTER,
            receivers=(MASTER if pdo.is_sent else drive,),
            signals=pdo_signals(dictionary, pdo.entries, scales, axis.profile.homed_bit),
            comment=f"{pdo.name} of drive {axis.node_id} ({axis.profile.name})",
            extended=extended,
        )


def _refuse_shared(messages: Sequence[Message]) -> None:
    owners: dict[int, str] = {}
    for message in messages:
        owner = owners.setdefault(message.key, message.name)
        if owner != message.name:
            raise EdsError(f"{owner} and {message.name} have the same identifier 0x{message.can_id:X} by their EDS")
