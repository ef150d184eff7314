"""Records that compiled code is given by their address: to unwrap an array of numpy's takes 35 ns longer, at each call.

In a kernel such an argument is read as the array would be: `wires[0]` is its record.
"""

import operator
from collections.abc import Callable
from typing import Any, Final

import numba
from numba import extending

_types: Final[Any] = numba.types  # it has no types
_extending: Final[Any] = extending


class RecordAt(_types.Type):  # type: ignore[misc]
    """Numba's type of a record's address.

    Attributes:
        record: The record's type.
    """

    def __init__(self, record: Any) -> None:  # noqa: ANN401
        self.record = record
        super().__init__(name=f"RecordAt({record})")


_extending.register_model(RecordAt)(_extending.models.OpaqueModel)


@_extending.unbox(RecordAt)  # type: ignore[untyped-decorator]
def _address(_kind: RecordAt, value: Any, context: Any) -> Any:  # noqa: ANN401
    """An integer as a pointer."""
    return _extending.NativeValue(context.pyapi.long_as_voidptr(value))


@_extending.intrinsic  # type: ignore[untyped-decorator]
def _record_at(_context: Any, at: RecordAt) -> Any:  # noqa: ANN401
    """The record at an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ANN401
        return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

    return at.record(at), generate


@_extending.overload(operator.getitem)  # type: ignore[untyped-decorator]
def _first(at: Any, place: Any) -> Callable[[Any, Any], Any] | None:  # noqa: ANN401, ARG001  (numba goes by names)
    """What `[0]` makes of it: there is one record."""

    def record_at(at: Any, place: Any) -> Any:  # noqa: ANN401, ARG001
        return _record_at(at)

    return record_at if isinstance(at, RecordAt) else None
