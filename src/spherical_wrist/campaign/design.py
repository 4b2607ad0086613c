"""Designs of experiments: values of the varied parameters for each sample.

Nothing is kept per sample: a batch of samples follows from its first and last index alone, by the digits of a grid, by
fast-forwarding a Sobol sequence, or by seeding a generator with the index of the sample (counter-based). Only a Latin
hypercube is drawn as a whole, once in a process, 8 bytes for each number.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from math import prod
from typing import Any, Literal

import numpy as np
from scipy.stats import qmc

from spherical_wrist.arrays import Array
from spherical_wrist.campaign.distribution import Distribution
from spherical_wrist.errors import ParameterError

Vary = Mapping[str, Distribution]
DesignName = Literal["grid", "latin_hypercube", "sobol", "random"]

SOBOL_BITS = 32
"""Bits of each coordinate of a Sobol point; SciPy cannot fast-forward more."""

OF_DESIGN, OF_SAMPLE, OF_EPISODE = 0, 1, 2
"""Streams of random numbers drawn from the seed of a campaign."""


def stream(seed: int, *key: int) -> np.random.SeedSequence:
    """Return the seed sequence of a stream, or of a sample in it."""
    return np.random.SeedSequence(seed, spawn_key=key)


def grid_size(vary: Vary) -> int:
    """Count the points of the grid over ``vary``.

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
    """Draw the values of the varied parameters, by name, of the samples ``first`` up to but not including ``last``.

    Args:
        design: ``grid``: every combination, the last parameter changing fastest. ``latin_hypercube``: every parameter
            has one value in each of ``samples`` slices of equal probability (McKay, Beckman and Conover, 1979).
            ``sobol``: a scrambled Sobol sequence, best with a power of two of samples. ``random``: independent.
        vary: distributions by parameter.
        samples: number of samples of the whole design.
        seed: of the campaign.
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
    """Return the seed of everything random in the episodes of a sample: one of 2⁶³, the same under every law."""
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
