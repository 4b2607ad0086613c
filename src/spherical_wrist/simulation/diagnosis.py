"""What a law does wrong, found by running one step of it as plain Python, where it can raise."""

import numpy as np
import numpy.typing as npt

from spherical_wrist.control.contract import COMMAND, Law
from spherical_wrist.errors import LawError, one_line
from spherical_wrist.simulation.engine import interpreted_step


def check_step(law: Law, signal: npt.NDArray[np.void], state: npt.NDArray[np.float64]) -> None:
    """Runs one step of ``law`` on a copy of its state.

    Args:
        law: the law.
        signal: SIGNAL array of length one.
        state: the law's state, left as it is.

    Raises:
        LawError: the step raises, or leaves a torque that is not finite; the message says which.
    """
    command = np.full(COMMAND.itemsize // 8, np.nan).view(COMMAND).view(np.recarray)
    time = float(signal["time"][0])
    name = f"law {law.name!r} at t = {time:.6g} s"
    try:
        interpreted_step(law)(signal.view(np.recarray)[0], law.packed(), state.copy(), command[0])
    except Exception as error:  # a user's law may raise anything
        raise LawError(f"{name} raised {type(error).__name__}: {one_line(error)}") from None
    torque = command["torque"][0]
    if not np.isfinite(torque).all():
        raise LawError(
            f"{name} wrote the torque {torque.tolist()} N·m: command.torque[0], [1] and [2] must be finite numbers"
        )
