"""Feedback of the sampled double integrator ë = −u, u held for a period, by the place of its poles.

Exactly, with no limit on the bandwidth: (e, ė) after a period T is (e + T ė − ½ T² u, ė − T u), so that u = k₀ e + k₁ ė
leaves z² − (2 − ½ T² k₀ − T k₁) z + 1 + ½ T² k₀ − T k₁. Two poles p = exp(−ω T) need

    k₀ = (1 − p)² / T²,    k₁ = (1 − p) (3 + p) / (2 T),

which are ω² and 2 ω for short periods (Franklin, Powell and Workman, 1998, Digital Control of Dynamic Systems).
"""

from math import exp


def critically_damped(bandwidth: float, period: float) -> tuple[float, float]:
    """Return the gains of the error [1/s²] and of its rate [1/s] that put both poles at exp(−ω T).

    Args:
        bandwidth: ω [1/s].
        period: T [s].
    """
    p = exp(-bandwidth * period)
    return (1.0 - p) * (1.0 - p) / (period * period), 0.5 * (1.0 - p) * (3.0 + p) / period
