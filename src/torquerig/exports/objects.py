"""Signals for the objects of an object dictionary that a PDO can carry."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final, NamedTuple

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from torquerig.driver.errors import EdsError
from torquerig.driver.master.profile import CONTROLWORD, STATUSWORD, ObjectAddress
from torquerig.driver.wire.cia402 import Command, OperationMode, decode_state
from torquerig.driver.wire.dictionary import find_variable
from torquerig.driver.wire.pdo import split_mapping_entry
from torquerig.exports.dbc import Signal
from torquerig.exports.services import ERROR_CODES

NAME_LENGTH: Final = 32
"""Characters of a name that every reader of DBC takes."""

_FIRST_OBJECT: Final = 0x1000  # below are data types, mapped as fillers (CiA 301, 7.4.7)
_STATE_BITS: Final = 7
_FLAGS: Final = MappingProxyType(
    {
        7: ("Warning", ""),
        8: ("Manufacturer_8", ""),
        9: ("Remote", "The controlword is obeyed"),
        10: ("Target_reached", ""),
        11: ("Internal_limit", ""),
        12: ("Target_used", "In cyclic synchronous torque; in homing mode: home attained"),
        13: ("Homing_error", "In homing mode"),
        14: ("Manufacturer_14", ""),
        15: ("Manufacturer_15", ""),
    }
)
_MODES: Final = MappingProxyType({int(mode): mode.name.lower().replace("_", " ") for mode in OperationMode})
_CHOICES: Final = MappingProxyType({(0x6060, 0): _MODES, (0x6061, 0): _MODES, (0x603F, 0): ERROR_CODES})


class Scale(NamedTuple):
    """What a raw 1 of an object stands for.

    Attributes:
        factor: How much.
        unit: Of what.
        note: What a person should know besides.
    """

    factor: float
    unit: str
    note: str = ""


def pdo_signals(
    dictionary: canopen.ObjectDictionary,
    entries: Iterable[int],
    scales: Mapping[tuple[int, int], Scale],
    homed_bit: int | None = None,
) -> tuple[Signal, ...]:
    """The signals of a PDO.

    Args:
        dictionary: The object dictionary.
        entries: Mapping entries: index, sub-index, length in bits.
        scales: What is known of objects' units, by address; an object that is not there stays a raw number.
        homed_bit: Bit of the statusword that tells whether the position refers to home.

    Returns:
        The signals, with one for each part of statusword and controlword; none for fillers.

    Raises:
        EdsError: The dictionary does not hold an object, or it is no number.
    """
    signals: list[Signal] = []
    start = 0
    for entry in entries:
        index, subindex, bits = split_mapping_entry(entry)
        if index >= _FIRST_OBJECT:
            address = ObjectAddress(index, subindex)
            if address == STATUSWORD:
                signals += _statusword(start, homed_bit)
            elif address == CONTROLWORD:
                signals += _controlword(start)
            else:
                signals.append(_object(dictionary, address, start, bits, scales.get(address)))
        start += bits
    return tuple(_named_apart(signals))


def identifier(words: str) -> str:
    """Words as a name in a DBC: an identifier of C, cut to 32 characters."""
    name = re.sub(r"\W+", "_", words, flags=re.ASCII).strip("_")
    return (name if name[:1].isalpha() else f"_{name}")[:NAME_LENGTH]


def _object(
    dictionary: canopen.ObjectDictionary, address: ObjectAddress, start: int, bits: int, scale: Scale | None
) -> Signal:
    variable = find_variable(dictionary, *address)
    if variable is None:
        raise EdsError(f"object {address} is mapped, but the EDS does not hold it")
    is_real = variable.data_type in datatypes.FLOAT_TYPES
    if not is_real and variable.data_type not in {*datatypes.INTEGER_TYPES, datatypes.BOOLEAN}:
        raise EdsError(f"object {address} ({variable.qualname}) is mapped, but it is no number")
    factor, unit, note = scale or Scale(1, "")
    return Signal(
        name=identifier(variable.name),
        start=start,
        length=bits,
        signed=is_real or variable.data_type in datatypes.SIGNED_TYPES,
        real=is_real,
        factor=factor,
        unit=unit,
        comment=f"Object {address} {variable.qualname}{'; ' if note else ''}{note}",
        raw_limits=_limits(variable),
        choices=_CHOICES.get(address, {}),
    )


def _limits(variable: ODVariable) -> tuple[float, float] | None:
    """Least and greatest raw value by the EDS, if it tells both."""
    if variable.min is None or variable.max is None:
        return None
    return variable.min, variable.max


def _statusword(start: int, homed_bit: int | None) -> Iterator[Signal]:
    """The state in words, and the bits above it one by one (CiA 402, object 6041)."""
    states = {bits: state.words for bits in range(1 << _STATE_BITS) if (state := decode_state(bits)) is not None}
    about = "Object 6041:0 Statusword, bits 0 to 6; bit 4: voltage enabled"
    yield Signal("Drive_state", start, _STATE_BITS, comment=about, choices=states)
    for bit, (name, note) in _FLAGS.items():
        if bit == homed_bit:
            name, note = "Homed", "Manufacturer's: the position refers to the home fixture"  # noqa: PLW2901
        comment = f"Object 6041:0 Statusword, bit {bit}{'; ' if note else ''}{note}"
        yield Signal(name, start + bit, 1, comment=comment)


def _controlword(start: int) -> Iterator[Signal]:
    """The command in words, and the bits above it (CiA 402, object 6040)."""
    nothing: dict[int, str] = {}
    parts = (
        ("Command", 0, 4, _commands()),
        ("Mode_bits", 4, 3, nothing),
        ("Fault_reset", 7, 1, nothing),
        ("Halt", 8, 1, nothing),
        ("Bits_9_to_15", 9, 7, nothing),
    )
    for name, bit, length, choices in parts:
        bits = f"bit {bit}" if length == 1 else f"bits {bit} to {bit + length - 1}"
        yield Signal(name, start + bit, length, comment=f"Object 6040:0 Controlword, {bits}", choices=choices)


def _commands() -> dict[int, str]:
    """Every value of bits 0 to 3 with the commands that it is; 0111 is two, told apart by the drive's state."""
    commands = [each for each in Command if each is not Command.FAULT_RESET]
    return {
        bits: ", ".join(each.words for each in commands if bits & each.mask == each.pattern) for bits in range(1 << 4)
    }


def _named_apart(signals: Iterable[Signal]) -> Iterator[Signal]:
    """The signals, with a number behind each name that was there before."""
    taken: set[str] = set()
    for signal in signals:
        name, count = signal.name, 1
        while name in taken:
            count += 1
            name = f"{signal.name[: NAME_LENGTH - len(str(count)) - 1]}_{count}"
        taken.add(name)
        yield signal if name == signal.name else replace(signal, name=name)
