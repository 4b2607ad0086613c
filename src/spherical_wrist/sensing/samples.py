"""Random faults of the samples, drawn before the samples are taken."""

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.sensing.description import Sensing

SAMPLE = np.dtype(
    [("attitude_noise", "f8", 3), ("rate_noise", "f8", 3), ("age", "f8"), ("lost", "f8")],
    align=True,
)
"""Faults at one control instant: errors of attitude [rad] and rate [rad/s], age of the sample [s], 1 if it is lost."""


class Samples:
    """Generator of the faults of consecutive samples; the same ones however many are drawn at a time.

    Args:
        sensing: the sensors.
        period: control period [s].
        seed: random seed; noise and losses have a generator each.
    """

    def __init__(self, sensing: Sensing, period: float, seed: int) -> None:
        self._sensing, self._period = sensing, period
        if not sensing.ideal:
            self._noise, self._loss = (np.random.default_rng([seed, 1, part]) for part in range(2))
        self._missing = 0  # how many samples in a row were lost at the end of the last piece
        self._drawn = 0

    def draw(self, time: npt.NDArray[np.float64]) -> npt.NDArray[Any]:
        """Draw the faults of the samples at the next control instants ``time`` [s], (n,), as an array of SAMPLE."""
        count = len(time)
        if self._sensing.ideal:
            return _faultless(count)
        samples = np.zeros(count, SAMPLE)
        unit = self._noise.standard_normal((count, 6))
        samples["attitude_noise"] = self._sensing.attitude_noise * unit[:, :3]
        samples["rate_noise"] = self._sensing.rate_noise * unit[:, 3:] + np.array(self._sensing.rate_bias)
        lost = self._loss.random(count) < self._sensing.loss
        if self._drawn == 0:
            lost[:1] = False
        samples["lost"] = lost
        index = np.arange(count)
        received = np.maximum.accumulate(np.where(lost, -1 - self._missing, index))
        missing = index - received
        samples["age"] = np.minimum(self._sensing.delay + self._period * missing, time)
        self._missing, self._drawn = int(missing[-1]) if count else self._missing, self._drawn + count
        return samples


@lru_cache(maxsize=4)
def _faultless(count: int) -> npt.NDArray[Any]:
    """Return samples without a fault: one array for all runs, which nobody writes into."""
    return np.zeros(count, SAMPLE)
