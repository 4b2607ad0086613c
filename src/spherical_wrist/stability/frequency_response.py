"""Frequency responses of a loop of sampled data, from its responses to pulses.

With h_k the outputs k control periods T after a unit pulse of an input, that input as a sine of frequency ω, held over
each period, gives Σ_k h_k exp(−j ω k T) times it at the control instants. Two such responses make a loop:

- the *sensitivity* S = (I + L)⁻¹ from a signal that is added where the loop is cut to the sum there,
- the *complementary sensitivity* T = I − S from it to what comes back around the loop, with the sign changed.

So L = S⁻¹ − I is known without opening the loop.
"""

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array

Complex = npt.NDArray[np.complex128]

POINTS = 400
"""Frequencies of a response."""

BLOCK = 64
"""Control periods of a block of a pulse response."""

LOWEST = 0.05
"""Lowest frequency [Hz]. Responses to pulses last up to 16 s."""


def frequencies(period: float) -> Array:
    """Return frequencies [Hz] in equal ratios, up to half the rate of the samples, for a control period [s]."""
    return np.geomspace(LOWEST, 0.5 / period, POINTS)


def frequency_response(pulse: Array, period: float, frequency: Array) -> Complex:
    """Return the response (m, 3, 3) at frequencies [Hz] (m,) of a system with a pulse response (n, 3, 3)."""
    # in blocks, for which far fewer exponentials are needed: k = BLOCK a + b
    blocks = -(-len(pulse) // BLOCK)
    padded = np.zeros((blocks * BLOCK, *pulse.shape[1:]))
    padded[: len(pulse)] = pulse
    turn = -2.0j * np.pi * period * frequency[:, None]
    within = np.tensordot(
        np.exp(turn * np.arange(BLOCK)), padded.reshape(blocks, BLOCK, *pulse.shape[1:]), ((1,), (1,))
    )
    found: Complex = np.einsum("ma,maoi->moi", np.exp(turn * BLOCK * np.arange(blocks)), within)
    return found


def loop_gain(sensitivity: Complex) -> Complex:
    """Return the loop gain L = S⁻¹ − I, (m, 3, 3)."""
    return np.asarray(np.linalg.inv(sensitivity) - np.eye(sensitivity.shape[-1]), dtype=np.complex128)


def largest_gain(response: Complex) -> Array:
    """Return the largest singular value at each frequency, (m,)."""
    return np.asarray(np.linalg.svd(response, compute_uv=False)[:, 0], dtype=np.float64)
