"""The object dictionary out of an EDS (CiA 306), by the canopen library's reader."""

from configparser import Error as ParserError
from functools import lru_cache
from io import StringIO
from pathlib import Path
from typing import Final

import canopen
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes
from canopen.objectdictionary.eds import import_eds

from torquerig.driver.errors import EdsError
from torquerig.driver.wire import cob

DRIVE_EDS: Final = Path(__file__).parent.parent / "data" / "torquerig-drive.eds"

_REMEMBERED: Final = 64  # dictionaries: half of all nodes that a bus can have

_STRUCT_CODES: Final = {
    datatypes.BOOLEAN: "?",
    datatypes.INTEGER8: "b",
    datatypes.INTEGER16: "h",
    datatypes.INTEGER32: "i",
    datatypes.INTEGER64: "q",
    datatypes.UNSIGNED8: "B",
    datatypes.UNSIGNED16: "H",
    datatypes.UNSIGNED32: "I",
    datatypes.UNSIGNED64: "Q",
    datatypes.REAL32: "f",
    datatypes.REAL64: "d",
}


def load_dictionary(path: Path, node_id: int) -> canopen.ObjectDictionary:
    """The object dictionary in an EDS or DCF, its $NODEID defaults worked out.

    Whoever asks for the same content again gets the same object, which is not to be changed: reading one takes 50 ms.

    Args:
        path: The file.
        node_id: Node-id, 1 to 127.

    Raises:
        EdsError: The file cannot be read, or is no EDS.
        ValueError: The node-id is out of range.
    """
    cob.check_node_id(node_id)
    try:
        text = _decode(path.read_bytes())
    except OSError as error:
        raise EdsError(f"the EDS {path} cannot be read: {error.strerror or error}") from error
    if "[DeviceInfo]" not in text:
        raise EdsError(f"{path} is no EDS: it has no section DeviceInfo")
    try:
        dictionary = _import(text, node_id)
    except (ParserError, ValueError, KeyError) as error:
        raise EdsError(f"{path} is no EDS: {str(error).splitlines()[0]}") from error
    if not dictionary.indices:
        raise EdsError(f"{path} is no EDS: it holds no object")
    return dictionary


@lru_cache(maxsize=_REMEMBERED)
def _import(text: str, node_id: int) -> canopen.ObjectDictionary:
    dictionary: canopen.ObjectDictionary = import_eds(StringIO(text), node_id)  # type: ignore[no-untyped-call]
    return dictionary


def find_variable(dictionary: canopen.ObjectDictionary, index: int, subindex: int = 0) -> ODVariable | None:
    """The variable that the EDS itself holds, or None: canopen's own lookup invents members of arrays."""
    entry = dictionary.indices.get(index)
    if isinstance(entry, ODVariable):
        return entry if subindex == 0 else None
    if isinstance(entry, ODArray | ODRecord):
        return entry.subindices.get(subindex)
    return None


def struct_code(variable: ODVariable) -> str:
    """The letter of the struct module for the variable's data type.

    Raises:
        EdsError: The type has none: strings, domains, integers of 24, 40, 48 or 56 bits.
    """
    code = _STRUCT_CODES.get(variable.data_type or 0)
    if code is None:
        raise EdsError(f"object {variable.index:04X}:{variable.subindex} has no plain numeric type")
    return code


def _decode(content: bytes) -> str:
    """The text of an EDS: CiA 306 asks for ASCII, makers write degree signs in UTF-8 or in Latin-1."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")
