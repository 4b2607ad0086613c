"""Arrays passed by address, for compiled functions that run many loops in one call.

A call from Python converts its arguments one by one, which costs more than a step of the loop. A record of addresses
replaces them. The compiled code does not check the addresses: the caller must keep the arrays alive.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

ARRAY = np.dtype([("address", "i8"), ("rows", "i8"), ("columns", "i8")], align=True)
"""Address of an array, number of rows, and numbers per row; of a one-dimensional array, ``columns`` is the stride."""


def array_address(array: npt.NDArray[Any]) -> tuple[int, int, int]:
    """Return an array as an ARRAY entry.

    Raises:
        ValueError: the array has two dimensions and is not contiguous.
    """
    if not (array.ndim == 1 or array.flags.c_contiguous):
        raise ValueError(f"an array with strides {array.strides} cannot be passed by its address")
    columns = array.shape[1] if array.ndim == 2 else array.strides[0] // array.itemsize
    return array.ctypes.data, array.shape[0], columns


def array_addresses(value: Any) -> Any:
    """Convert nested tuples of numbers and arrays to the entries of a record with the same nesting."""
    if isinstance(value, tuple):
        return tuple(map(array_addresses, value))
    return array_address(value) if isinstance(value, np.ndarray) else value


def law_at(address: int) -> Any:
    """Return the compiled step of a law by its address. For compiled code only, like the functions below."""
    raise NotImplementedError


def numbers(array: Any) -> Any:
    """Return the one-dimensional float64 array of an ARRAY entry."""
    raise NotImplementedError


def table(array: Any) -> Any:
    """Return the two-dimensional float64 array of an ARRAY entry."""
    raise NotImplementedError


def counters(array: Any) -> Any:
    """Return the one-dimensional int32 array of an ARRAY entry, with its stride."""
    raise NotImplementedError


def records(array: Any, kind: Any) -> Any:
    """Return the one-dimensional array of an ARRAY entry with elements of a structured dtype."""
    raise NotImplementedError
