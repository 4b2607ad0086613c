"""Switching functions of a sliding surface, each with a boundary layer φ; eq. (25) and its smooth forms."""

from math import tanh

SIGN, SATURATION, TANH = 0.0, 1.0, 2.0


def switch(kind: float, surface: float, layer: float) -> float:
    """The switching function in [−1, 1] of one axis.

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
