"""Types of the loop for numba: arguments of compiled functions, and replacements of functions that have no Python.

It is loaded only where the cache has no machine code, since numba takes a second to import.
"""

from collections.abc import Callable
from types import FunctionType
from typing import Any

import mujoco
import numba
import numpy as np
import numpy.typing as npt
from numba.core import types

from spherical_wrist.compat import numba as codegen
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.dynamics import MOTION, Nominal, pointer
from spherical_wrist.loop import addresses
from spherical_wrist.loop.loop import LOG, unrolled
from spherical_wrist.loop.machine_code import MachineCode
from spherical_wrist.measure.metrics import METRIC_SETTINGS, TOTALS

ARGUMENTS = {
    "mj_step": 2,
    "mj_kinematics": 2,
    "mj_comPos": 2,
    "mj_flex": 2,
    "mj_tendon": 2,
    "mj_makeM": 2,
    "mj_fwdVelocity": 2,
    "mj_fullM": 3,
}
"""C functions of MuJoCo that compiled code calls, with their number of arguments. All arguments are machine words."""


def emit(
    function: FunctionType, signature: str | tuple[npt.DTypeLike, ...], foreign: Callable[[Any], bool]
) -> MachineCode:
    """Compile a function.

    Args:
        function: plain Python function of scalar loops; functions that it names are compiled with it.
        signature: name in :data:`SIGNATURES`, or dtypes of contiguous arrays: of one dimension of records, of two of
            numbers.
        foreign: tells functions of a user.

    Raises:
        Exception: numba cannot compile it.
    """
    arguments = SIGNATURES[signature] if isinstance(signature, str) else tuple(map(_array, signature))
    found = codegen.emit(function, arguments, codegen.Task(foreign, REPLACED))
    return MachineCode(found.symbol, _returned_words(found.returned), found.imports, found.code)


_record = numba.from_dtype
_vector, _matrix = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")


def _array(kind: npt.DTypeLike) -> Any:
    dtype = np.dtype(kind)
    return types.Array(_record(dtype), 1 if dtype.names else 2, "C")


_nominal = types.NamedTuple([types.intp, types.intp] + [_vector] * (len(Nominal._fields) - 2), Nominal)
_motion, _log = map(_array, (MOTION, LOG))
_law = codegen.Address("law", types.void(_record(SIGNAL), _vector, _vector, _record(COMMAND)))

SIGNATURES = {
    "law": _law.signature.args,
    "inverse": (_nominal, _motion, _matrix, _matrix),
    "accumulate": (_record(METRIC_SETTINGS), _record(TOTALS), _vector, _motion, _log, _matrix),
}
"""Arguments of a law's step, of the inverse dynamics and of the sums of the metrics."""

REPLACED: dict[Any, Any] = {
    pointer: codegen.address_of,
    addresses.numbers: codegen.array_at(_vector),
    addresses.table: codegen.array_at(_matrix),
    addresses.counters: codegen.array_at(types.Array(types.int32, 1, "A")),
    addresses.records: codegen.records_at,
    addresses.law_at: codegen.function_at(_law),
    unrolled: numba.literal_unroll,
    **{
        getattr(mujoco, name): types.ExternalFunction(name, types.void(*[types.intp] * count))
        for name, count in ARGUMENTS.items()
    },
}
"""Replacements in compiled code for functions of Python: intrinsics, and C functions of libmujoco."""


def _returned_words(kind: Any) -> int:
    if kind == types.none:
        return 0
    if isinstance(kind, types.Integer) and kind.bitwidth == 64:
        return 1
    if isinstance(kind, types.BaseTuple) and set(kind) == {types.int64}:
        return len(kind)
    raise TypeError(f"it returns {kind}, which is neither nothing nor 64-bit integers")
