"""Two ways to run the closed loop: compiled, or as the plain Python that it is written in."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.control.contract import Law
from spherical_wrist.dynamics import inverse_dynamics
from spherical_wrist.simulation import compiler
from spherical_wrist.simulation.gauge import gauge
from spherical_wrist.simulation.loop import close_loop


class Engine(NamedTuple):
    """The functions to run, and how what they take is handed to them.

    Attributes:
        close_loop: see :func:`spherical_wrist.simulation.loop.close_loop`.
        inverse_dynamics: see :func:`spherical_wrist.dynamics.inverse_dynamics`.
        gauge: see :func:`spherical_wrist.simulation.gauge.gauge`.
        step: a law's step, taking its parameters packed.
        handle: of an MjModel or MjData, what the functions take for it.
        record: of a structured array of length one, what the functions take for its only element.
        records: of a structured array, what the functions take for it.
    """

    close_loop: Callable[..., Any]
    inverse_dynamics: Callable[..., None]
    gauge: Callable[..., None]
    step: Callable[[Law], Any]
    handle: Callable[[Any], Any]
    record: Callable[[npt.NDArray[Any]], Any]
    records: Callable[[npt.NDArray[Any]], Any]


def compiled_engine() -> Engine:
    """Machine code, within a microsecond of the physics itself."""
    return Engine(
        compiler.compiled_loop(),
        compiler.compiled_inverse_dynamics(),
        compiler.compiled_gauge(),
        compiler.compiled_law,
        lambda owner: owner._address,
        lambda array: array[0],
        lambda array: array,
    )


def interpreted_engine() -> Engine:
    """The same source as plain Python: for a debugger, hundreds of times slower."""
    return Engine(
        close_loop,
        inverse_dynamics,
        gauge,
        interpreted_step,
        lambda owner: owner,
        lambda array: array.view(np.recarray)[0],
        lambda array: array.view(np.recarray),
    )


def interpreted_step(law: Law) -> Callable[..., None]:
    """The law's step as plain Python, taking its parameters packed."""
    step, layout = type(law).step, law.layout()

    def unpack_and_step(signal: Any, packed: npt.NDArray[np.float64], state: Any, command: Any) -> None:
        step(signal, packed.view(layout).view(np.recarray)[0], state, command)

    return unpack_and_step
