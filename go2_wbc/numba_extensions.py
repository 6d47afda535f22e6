"""What Numba is taught of records: their arrays are arrays, and their numbers one array."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core.imputils import lower_cast
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array, populate_array

from go2_wbc.records import numbers_of


@overload(numbers_of, strict=False)
def _numbers_of(record: Any) -> Any:
    del record
    return lambda record: _row_of(record)  # pyright: ignore[reportCallIssue]


@intrinsic
def _row_of(_context: Any, record: Any) -> Any:
    """The memory of a record."""
    array = types.Array(types.float64, 1, "C")

    def build(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        row = make_array(array)(context, builder)
        kind = context.get_value_type(types.CPointer(types.float64))
        shape = (context.get_constant(types.intp, record.size // 8),)
        step = context.get_constant(types.intp, 8)
        populate_array(
            row,
            data=builder.bitcast(arguments[0], kind),
            shape=shape,
            strides=(step,),
            itemsize=step,
            meminfo=None,
        )
        return row._getvalue()

    return array(record), build


@lower_cast(types.NestedArray, types.Array)
def _array_of_a_record(_context: Any, _builder: Any, _from: Any, _to: Any, value: Any) -> Any:
    """An array in a record is one like others; without this, Numba stops with a bare assertion."""
    return value
