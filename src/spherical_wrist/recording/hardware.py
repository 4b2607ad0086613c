"""What sensors and motors that are not ideal do, for plots of their own."""

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Arrays = Mapping[str, Array]


def _turned(arrays: Arrays) -> Array:
    """log(q⁻¹ ⊗ q_m) [rad], body frame: from the true attitude to the measured one, delay and all."""
    true, seen = arrays["attitude"], arrays["measured_attitude"]
    w = np.einsum("ij,ij->i", true, seen)
    v = true[:, :1] * seen[:, 1:] - seen[:, :1] * true[:, 1:] - np.cross(true[:, 1:], seen[:, 1:])
    sine = np.linalg.norm(v, axis=1)
    scale = 2.0 * np.arctan2(sine, np.abs(w)) / np.where(sine > 0.0, sine, 1.0)
    turned: Array = np.where(w < 0.0, -scale, scale)[:, None] * v
    return turned


_CURVES: Mapping[str, tuple[str, Callable[[Arrays], Array]]] = {
    "sensed_attitude": ("measured_attitude", _turned),
    "sensed_rate": ("measured_rate", lambda arrays: arrays["measured_rate"] - arrays["rate"]),
    "made_torque": ("commanded_torque", lambda arrays: arrays["torque"] - arrays["commanded_torque"]),
    "current": ("current", lambda arrays: arrays["current"]),
    "condition": ("condition", lambda arrays: arrays["condition"]),
}
"""Of every plot in ``layout.HARDWARE``, the array that a run with such hardware has, and the curves, one a column."""


def hardware_curves(arrays: Arrays) -> dict[str, Array]:
    """The curves that a run has something for, (n, m) each, by the name of their plot.

    Args:
        arrays: of a series, by name. A run that diverged may have anything in its last rows.
    """
    with np.errstate(all="ignore"):
        curves = {name: curve(arrays) for name, (needed, curve) in _CURVES.items() if arrays[needed].size}
    return {name: array for name, array in curves.items() if np.isfinite(array).any()}
