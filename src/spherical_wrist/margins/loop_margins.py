"""Margins of a loop that is cut at one place, from its sensitivity.

The loop is stable as it is. It stays so while a disturbing factor on each axis of the cut lies within

- the *gain margins*: real factors between the gain reduction margin and the gain margin,
- the *phase margin* and the *delay margin*: factors exp(−j φ), and delays exp(−j ω τ),
- the *disk margin* α: complex factors (1 + (1 − σ)/2 δ_i) / (1 − (1 + σ)/2 δ_i), σ = 0, any |δ_i| < α on every axis
  at its own: gain and phase at once (Seiler, Packard and Gahinet, *An Introduction to Disk Margins*, IEEE Control
  Systems Magazine 40(5), 2020, doi:10.1109/MCS.2020.3005277). α = 1 / max_ω μ(S + (σ − 1)/2 I).

Gain, phase and delay margins are the smallest of the loops of single axes with the others closed, 1/S_ii − 1, and of
the same factor on all axes, the eigenvalues of L. python-control finds the crossings; μ is the upper bound of SLICOT's
AB13MD, which is exact for three complex blocks.
"""

from collections.abc import Iterator
from itertools import pairwise, permutations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ParameterError
from spherical_wrist.margins.frequency_response import frequency_response, largest_gain, loop_gain

try:
    from control import FrequencyResponseData, stability_margins
    from slycot import ab13md
except ImportError:
    raise ParameterError("margins need python-control and Slycot: pip install 'spherical-wrist[margins]'") from None

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

FARTHEST_DB = 60.0
"""Gain margins beyond this are none: the loop is stable at any gain, but for what was cut off from its response."""


class LoopMargins(NamedTuple):
    """Margins of a loop that is cut at one place. None where nothing makes it unstable.

    Attributes:
        max_sensitivity: largest singular value of the sensitivity, over all frequencies (Ms).
        max_complementary: the same of the complementary sensitivity.
        axis_sensitivity: largest |S_ii|, by axis.
        gain_margin_db: increase of the gain that makes the loop unstable [dB].
        gain_reduction_margin_db: reduction of the gain that makes it unstable [dB].
        phase_margin_deg: phase that makes it unstable, of either sign [°].
        delay_margin_s: delay that makes it unstable [s].
        disk_margin: α of all axes together.
    """

    max_sensitivity: float
    max_complementary: float
    axis_sensitivity: tuple[float, float, float]
    gain_margin_db: float | None
    gain_reduction_margin_db: float | None
    phase_margin_deg: float | None
    delay_margin_s: float | None
    disk_margin: float


def loop_margins(pulse: Array, period: float, frequency: Array) -> LoopMargins:
    """Compute the margins of a loop.

    Args:
        pulse: response of the sum at the cut, to a unit pulse that is added there, (n, 3, 3).
        period: control period [s].
        frequency: frequencies [Hz], the last one half the rate of the samples.
    """
    sensitivity = frequency_response(pulse, period, frequency)
    gains, phases, delays = [], [], []
    single = (1.0 / sensitivity[:, i, i] - 1.0 for i in range(3))
    ends = frequency_response(pulse, period, np.array([0.0, 0.5 / period]))
    for loop in [*single, *_eigenvalues(loop_gain(sensitivity))]:
        found = crossings(loop, frequency)
        gains += found.gains
        phases += found.phases
        delays += found.delays
    # at no frequency, and at half the rate of the samples, the gain is real: it may touch −1 without crossing
    touching = [loop_gain(ends), *(1.0 / ends[:, i, i][:, None, None] - 1.0 for i in range(3))]
    for loop in touching:
        real = np.linalg.eigvals(loop).real.ravel()
        gains += (-1.0 / real[real < 0.0]).tolist()
    decibels = [20.0 * float(np.log10(gain)) for gain in gains if gain > 0.0]
    decibels = [each for each in decibels if abs(each) < FARTHEST_DB]
    complementary = np.eye(3) - sensitivity
    return LoopMargins(
        float(largest_gain(sensitivity).max()),
        float(largest_gain(complementary).max()),
        tuple(np.abs(sensitivity[:, range(3), range(3)]).max(axis=0).tolist()),
        min((each for each in decibels if each > 0.0), default=None),
        min((-each for each in decibels if each < 0.0), default=None),
        min(map(abs, phases), default=None),
        min(delays, default=None),
        disk_margin(sensitivity),
    )


class Crossings(NamedTuple):
    """Changes of one loop that make its gain touch −1.

    Attributes:
        gains: factors on the gain.
        phases: phases [°], −180 to 180.
        delays: delays [s].
    """

    gains: list[float]
    phases: list[float]
    delays: list[float]


def crossings(loop: Complex, frequency: Array) -> Crossings:
    """Find the changes of one loop that make it unstable, from its gain (m,) at frequencies [Hz] (m,)."""
    response = FrequencyResponseData(loop, 2.0 * np.pi * frequency, smooth=True)
    gains, phases, _, _, at, _ = stability_margins(response, returnall=True)
    delays = np.deg2rad(np.mod(phases, 360.0)) / at
    return Crossings(gains.tolist(), phases.tolist(), delays.tolist())


def disk_margin(sensitivity: Complex, skew: float = 0.0) -> float:
    """Return the disk margin α with skew σ of a loop with a sensitivity (m, n, n)."""
    size = sensitivity.shape[-1]
    centred = sensitivity + 0.5 * (skew - 1.0) * np.eye(size)
    blocks, complex_ones = np.ones(size, int), np.full(size, 2)
    return 1.0 / max(float(ab13md(each, blocks, complex_ones)[0]) for each in centred)


def _eigenvalues(matrices: Complex) -> Iterator[Complex]:
    """Yield the eigenvalues of matrices (m, 3, 3), each as a continuous function of its row, (m,)."""
    found = np.linalg.eigvals(matrices)
    orders = np.array(list(permutations(range(found.shape[1]))))
    for before, after in pairwise(found):
        jumps = np.abs(after[orders] - before).sum(axis=1)
        after[:] = after[orders[jumps.argmin()]]
    yield from found.T
