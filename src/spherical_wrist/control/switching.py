"""Switching functions of a sliding surface, each with a boundary layer φ; eq. (25) and its smooth forms."""

from math import tanh
from typing import Literal

from spherical_wrist.control.contract import choice

SwitchingName = Literal["sign", "saturation", "tanh"]
SIGN, SATURATION, TANH = (choice(SwitchingName, name) for name in ("sign", "saturation", "tanh"))


def switch(kind: float, surface: float, layer: float) -> float:
    """Return the switching function in [−1, 1] of one axis.

    Args:
        kind: ``SIGN``: sgn(S), eq. (25); ``SATURATION``: S/φ clipped to [−1, 1]; ``TANH``: tanh(S/φ).
        surface: S [rad/s].
        layer: boundary layer φ [rad/s], > 0. ``SIGN`` does not use it.
    """
    if kind == TANH:
        return tanh(surface / layer)
    if kind == SATURATION:
        return min(1.0, max(-1.0, surface / layer))
    if surface > 0.0:
        return 1.0
    if surface < 0.0:
        return -1.0
    return 0.0
