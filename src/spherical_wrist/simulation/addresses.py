"""Arrays found by where they lie, for compiled functions that go through many runs of the loop in one call.

A call from Python takes its arguments apart one by one, which costs more than a step of the loop. Here they lie in one
record that has the address of each. What is compiled trusts it: whoever writes the record keeps the arrays alive.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

ARRAY = np.dtype([("at", "i8"), ("rows", "i8"), ("columns", "i8")], align=True)
"""Where an array lies: its address, rows, and numbers in a row; of one dimension, every so-many-th number counts."""


def where(array: npt.NDArray[Any]) -> tuple[int, int, int]:
    """An array as an ARRAY.

    Raises:
        ValueError: it has two dimensions, and its numbers do not lie one after the other.
    """
    if not (array.ndim == 1 or array.flags.c_contiguous):
        raise ValueError(f"an array with strides {array.strides} cannot be found by its address")
    columns = array.shape[1] if array.ndim == 2 else array.strides[0] // array.itemsize
    return array.ctypes.data, array.shape[0], columns


def laid(thing: Any) -> Any:
    """Addresses and arrays, in tuples of any depth, as a record of the same shape takes them."""
    if isinstance(thing, tuple):
        return tuple(map(laid, thing))
    return where(thing) if isinstance(thing, np.ndarray) else thing


def law_at(address: int) -> Any:
    """The law whose compiled step lies at an address. Compiled code only, like what follows."""
    raise NotImplementedError


def loop_at(address: int) -> Any:
    """The compiled loop that lies at an address."""
    raise NotImplementedError


def memory(address: int) -> Any:
    """An address as a pointer."""
    raise NotImplementedError


def carray(pointer: Any, shape: Any, kind: Any) -> Any:
    """A contiguous array at a pointer."""
    raise NotImplementedError


def numbers(array: Any) -> Any:
    """The array of float64 of one dimension that an ARRAY record stands for."""
    return carray(memory(array.at), (array.rows,), np.float64)


def table(array: Any) -> Any:
    """The array of float64 of two dimensions."""
    return carray(memory(array.at), (array.rows, array.columns), np.float64)


def counters(array: Any) -> Any:
    """The array of int32 of one dimension, with its stride."""
    return carray(memory(array.at), (array.rows * array.columns,), np.int32)[:: array.columns]


def records(array: Any, kind: Any) -> Any:
    """The array of records of a dtype."""
    return carray(memory(array.at), (array.rows,), kind)
