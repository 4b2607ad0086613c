"""Engines of the closed loop: compiled, or interpreted as plain Python."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.compat.libmujoco import address_of
from spherical_wrist.control.contract import Law
from spherical_wrist.dynamics import inverse_dynamics
from spherical_wrist.loop import compiler
from spherical_wrist.measure.metrics import accumulate


class Engine(NamedTuple):
    """Engine: functions of the closed loop, and conversions of their arguments.

    Attributes:
        compiled: True for machine code.
        inverse_dynamics: see :func:`spherical_wrist.dynamics.inverse_dynamics`.
        accumulate: see :func:`spherical_wrist.measure.metrics.accumulate`.
        step: returns the step of a law as a function of packed parameters and state.
        handle: converts an MjModel or MjData to the argument that the functions take.
        record: converts a structured array of length one to the argument for its only element.
        records: converts a structured array to the argument that the functions take.
    """

    compiled: bool
    inverse_dynamics: Callable[..., None]
    accumulate: Callable[..., None]
    step: Callable[[Law], Any]
    handle: Callable[[Any], Any]
    record: Callable[[npt.NDArray[Any]], Any]
    records: Callable[[npt.NDArray[Any]], Any]


def compiled_engine() -> Engine:
    """Return the compiled engine, whose overhead over the physics is about a microsecond per step."""
    return Engine(
        True,
        compiler.compiled_inverse_dynamics(),
        _accumulate,
        compiler.compiled_law,
        address_of,
        lambda array: array.ctypes.data,
        lambda array: array,
    )


def _accumulate(*arguments: Any) -> None:
    """Accumulate metrics in machine code, which is compiled where it is needed apart from the loop."""
    compiler.compiled_accumulate()(*arguments)


def interpreted_engine() -> Engine:
    """Return the interpreted engine: the same source as plain Python, for a debugger; hundreds of times slower."""
    return Engine(
        False,
        inverse_dynamics,
        accumulate,
        interpreted_step,
        lambda owner: owner,
        lambda array: array.view(np.recarray)[0],
        lambda array: array.view(np.recarray),
    )


def interpreted_step(law: Law) -> Callable[..., None]:
    """Return the step of a law in plain Python, as a function of packed parameters and state."""
    step, layout, state_layout = type(law).step, law.layout(), law.state_layout()

    def unpack_and_step(signal: Any, packed: Array, state: Array, command: Any) -> None:
        parameters, named = packed.view(layout).view(np.recarray)[0], state.view(state_layout).view(np.recarray)[0]
        step(signal, parameters, named, command)

    return unpack_and_step
