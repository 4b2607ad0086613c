"""Designs: which values the varied parameters take, sample by sample, whoever asks and in whatever order.

Nothing is kept per sample. A batch of samples is made from its first and last index alone: by a grid's digits, by
winding a Sobol sequence forward, or by seeding a generator with the index of the sample (counter-based). Only a Latin
hypercube is a whole: its numbers, 8 bytes each, are drawn once in a process.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from math import prod
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from spherical_wrist.campaign.distribution import Distribution
from spherical_wrist.errors import ParameterError

Array = npt.NDArray[np.float64]
Vary = Mapping[str, Distribution]
DesignName = Literal["grid", "latin_hypercube", "sobol", "random"]

SOBOL_BITS = 32
"""Of each coordinate of a Sobol point; SciPy cannot wind longer ones forward."""

OF_DESIGN, OF_SAMPLE, OF_EPISODE = 0, 1, 2
"""Streams of random numbers that are drawn from a campaign's seed."""


def stream(seed: int, *key: int) -> np.random.SeedSequence:
    """The seeds of one stream, or of one sample of it."""
    return np.random.SeedSequence(seed, spawn_key=key)


def grid_size(vary: Vary) -> int:
    """Number of points of the grid over ``vary``.

    Raises:
        ParameterError: a distribution is continuous.
    """
    for name, distribution in vary.items():
        if distribution.options is None:
            raise ParameterError(
                f"vary {name}: a grid needs values that can be counted: a list, or {{ linear = [low, high, how many] }}"
            )
    return prod(len(distribution.options or ()) for distribution in vary.values())


def draw(design: DesignName, vary: Vary, samples: int, seed: int, first: int, last: int) -> list[dict[str, Any]]:
    """The values of the varied parameters, by name, of the samples ``first`` up to but not including ``last``.

    Args:
        design: ``grid``: every combination, the last parameter changing fastest. ``latin_hypercube``: every parameter
            has one value in each of ``samples`` slices of equal probability (McKay, Beckman and Conover, 1979).
            ``sobol``: a scrambled Sobol sequence, best with a power of two of samples. ``random``: independent.
        vary: distributions by parameter.
        samples: number of samples of the whole design.
        seed: the campaign's.
        first: first sample.
        last: end of the samples.
    """
    if design == "grid":
        return [_grid_point(vary, sample) for sample in range(first, last)]
    numbers = _NUMBERS[design](len(vary), samples, seed, first, last)
    return [
        {name: distribution.value(u) for (name, distribution), u in zip(vary.items(), row, strict=True)}
        for row in numbers.tolist()
    ]


def episode_seed(seed: int, sample: int) -> int:
    """The seed of everything random in the episodes of a sample: one of 2⁶³, the same under every law."""
    return int(stream(seed, OF_EPISODE, sample).generate_state(1, np.uint64)[0]) >> 1


def _grid_point(vary: Vary, sample: int) -> dict[str, Any]:
    point = {}
    for name in reversed(list(vary)):
        options = vary[name].options or ()
        sample, digit = divmod(sample, len(options))
        point[name] = options[digit]
    return {name: point[name] for name in vary}


def _random(width: int, samples: int, seed: int, first: int, last: int) -> Array:
    rows = [np.random.default_rng(stream(seed, OF_SAMPLE, sample)).random(width) for sample in range(first, last)]
    return np.reshape(rows, (last - first, width))


def _sobol(width: int, samples: int, seed: int, first: int, last: int) -> Array:
    if not width:
        return np.empty((last - first, 0))
    sequence = qmc.Sobol(width, scramble=True, bits=SOBOL_BITS, rng=np.random.default_rng(stream(seed, OF_DESIGN)))
    if first:
        sequence.fast_forward(first)
        points = sequence.random(last - first)
    else:
        # the first point on its own: SciPy warns where the first draw is no power of two, whatever follows
        points = np.concatenate([sequence.random(1), sequence.random(last - 1)])
    # the middle of each cell: a zero would be the end of a tail that has none
    return np.asarray(points) + 0.5 ** (SOBOL_BITS + 1)


def _latin_hypercube(width: int, samples: int, seed: int, first: int, last: int) -> Array:
    return _whole_latin_hypercube(width, samples, seed)[first:last]


@lru_cache(maxsize=1)
def _whole_latin_hypercube(width: int, samples: int, seed: int) -> Array:
    if not width:
        return np.empty((samples, 0))
    return np.asarray(qmc.LatinHypercube(width, rng=np.random.default_rng(stream(seed, OF_DESIGN))).random(samples))


_NUMBERS: dict[str, Callable[[int, int, int, int, int], Array]] = {
    "random": _random,
    "sobol": _sobol,
    "latin_hypercube": _latin_hypercube,
}
