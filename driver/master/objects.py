"""The objects of one drive, typed by its EDS: bytes on the wire, numbers and texts here."""

from pathlib import Path
from struct import Struct
from struct import error as StructError  # noqa: N812 - the module's own name for it says nothing here

from canopen.objectdictionary import ObjectDictionary, ODVariable, datatypes

from torquerig.driver.errors import ConfigurationMismatch, DriveError, EdsError
from torquerig.driver.master.profile import ObjectAddress
from torquerig.driver.master.sdo_client import MAX_BYTES
from torquerig.driver.master.sdo_jobs import NUMBER_BYTES, Download, Job, Upload
from torquerig.driver.wire.dictionary import find_variable, load_dictionary, struct_code
from torquerig.driver.wire.pdo import PdoField, PdoLayout
from torquerig.driver.wire.sdo import SdoAbort, describe

Value = int | float | str | bytes

_TEXTS = frozenset({datatypes.VISIBLE_STRING, datatypes.UNICODE_STRING})
_BLOBS = frozenset({datatypes.OCTET_STRING, datatypes.DOMAIN})


class DriveObjects:
    """What the EDS says of one drive's objects.

    Attributes:
        node_id: The drive.
    """

    def __init__(
        self, node_id: int, eds: Path, dictionary: ObjectDictionary | None = None, *, kind: str = "drive"
    ) -> None:
        """Read the EDS.

        Args:
            node_id: The drive.
            eds: Its EDS.
            dictionary: What is in the EDS, if it was read already for another drive: only the defaults, which are not
                used here, depend on the node-id.
            kind: What messages call it; a transducer is none.

        Raises:
            EdsError: It cannot be read, or is none.
        """
        self.node_id = node_id
        self._who = f"{kind} {node_id}"
        self._eds = eds
        self._dictionary = load_dictionary(eds, node_id) if dictionary is None else dictionary

    @property
    def identity(self) -> dict[int, int]:
        """Vendor and product by the EDS, under their sub-indices 1 and 2 of 1018, as far as it tells them."""
        device = self._dictionary.device_information
        told = {1: device.vendor_number, 2: device.product_number}
        return {subindex: value for subindex, value in told.items() if value}

    def holds(self, index: int, subindex: int = 0) -> bool:
        """Whether the EDS holds the object."""
        return find_variable(self._dictionary, index, subindex) is not None

    def subindices(self, index: int) -> list[int]:
        """The sub-indices above 0 that the EDS holds of an object, rising."""
        return [subindex for subindex in range(1, 0xFF) if self.holds(index, subindex)]

    def title(self, index: int, subindex: int = 0) -> str:
        """The object in words: "1400:5 (RPDO1 communication parameter.Event timer)"."""
        return f"{ObjectAddress(index, subindex)} ({self._variable(index, subindex).qualname})"

    def name(self, index: int, subindex: int = 0) -> str:
        """What the EDS calls the object itself: "Event timer"."""
        return str(self._variable(index, subindex).name)

    def encode(self, index: int, subindex: int, value: Value) -> bytes:
        """A value as the object's bytes.

        Raises:
            EdsError: The EDS does not hold the object.
            ValueError: The value does not fit its type.
        """
        variable = self._variable(index, subindex)
        if isinstance(value, bytes) and variable.data_type in _BLOBS:
            return value
        if isinstance(value, str) and variable.data_type in _TEXTS:
            return bytes(variable.encode_raw(value))
        if isinstance(value, str | bytes) or variable.data_type in _TEXTS | _BLOBS:
            raise ValueError(f"{value!r} is no value for {self.title(index, subindex)}")
        code = struct_code(variable)
        number = value if code in "fd" else int(value)
        try:
            return Struct("<" + code).pack(number)
        except StructError:
            raise ValueError(f"{value} does not fit {self.title(index, subindex)}") from None

    def decode(self, index: int, subindex: int, data: bytes) -> Value:
        """The value in the object's bytes.

        Raises:
            EdsError: The EDS does not hold the object.
            DriveError: The drive sent fewer bytes than the type has.
        """
        variable = self._variable(index, subindex)
        if variable.data_type in _TEXTS:
            return str(variable.decode_raw(data)).rstrip("\0")
        if variable.data_type in _BLOBS:
            return bytes(data)
        codec = Struct("<" + struct_code(variable))
        if len(data) < codec.size:
            raise DriveError(
                f"{self._who} sends {len(data)} of the {codec.size} bytes of {self.title(index, subindex)}"
            )
        # more bytes come from servers that do not tell the size of expedited data (CiA 301, 7.2.4.3.5)
        value: Value = codec.unpack_from(data)[0]
        return value

    def layout(self, addresses: tuple[ObjectAddress, ...]) -> PdoLayout:
        """The layout of a PDO that maps these objects.

        Raises:
            EdsError: The EDS does not hold one of them, or it has no plain numeric type.
            ValueError: They have more than 8 bytes.
        """
        return PdoLayout(PdoField(*address, struct_code(self._variable(*address))) for address in addresses)

    def read(self, index: int, subindex: int = 0) -> Job[Value]:
        """A job: read one object."""
        is_number = self._variable(index, subindex).data_type not in _TEXTS | _BLOBS
        longest = NUMBER_BYTES if is_number else MAX_BYTES
        return self.decode(index, subindex, (yield Upload(index, subindex, longest)))

    def read_number(self, index: int, subindex: int = 0) -> Job[int]:
        """A job: read one object that holds a whole number."""
        value = yield from self.read(index, subindex)
        if not isinstance(value, int):
            raise EdsError(f"{self.title(index, subindex)} in {self._eds} is no whole number")
        return value

    def write(self, index: int, subindex: int, value: Value) -> Job[None]:
        """A job: write one object."""
        yield Download(index, subindex, self.encode(index, subindex, value))

    def write_verified(self, index: int, subindex: int, value: int, *, ignore: int = 0) -> Job[None]:
        """A job: write one object, read it back and compare.

        Args:
            index: Object.
            subindex: Its sub-index.
            value: What it is to hold.
            ignore: Bits that the drive may set as it likes.

        Raises:
            ConfigurationMismatch: The drive refuses the value, or reads back another one.
        """
        try:
            yield from self.write(index, subindex, value)
        except SdoAbort as abort:
            raise ConfigurationMismatch(
                f"{self._who} refuses {_both(value)} in {self.title(index, subindex)}: {describe(abort.code)}"
            ) from abort
        yield from self.verify(index, subindex, value, ignore=ignore)

    def verify(self, index: int, subindex: int, value: int, *, ignore: int = 0) -> Job[None]:
        """A job: read one object and compare.

        Raises:
            ConfigurationMismatch: The drive holds another value, or does not let it be read.
        """
        try:
            held = yield from self.read_number(index, subindex)
        except SdoAbort as abort:
            raise ConfigurationMismatch(
                f"{self._who} does not say what {self.title(index, subindex)} holds: {describe(abort.code)}"
            ) from abort
        if held & ~ignore != value & ~ignore:
            raise ConfigurationMismatch(
                f"{self._who} holds {_both(held)} in {self.title(index, subindex)}, not {_both(value)}"
            )

    def _variable(self, index: int, subindex: int) -> ODVariable:
        variable = find_variable(self._dictionary, index, subindex)
        if variable is None:
            raise EdsError(f"{self._who} has no object {ObjectAddress(index, subindex)} by its EDS {self._eds}")
        return variable


def _both(value: int) -> str:
    return f"{value} ({value:#x})" if value > 9 else str(value)
