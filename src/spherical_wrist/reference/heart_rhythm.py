"""Rhythm of a heart: its phase as a function of time, with heart-rate variability and premature beats."""

from typing import NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.reference.jet import Jet
from spherical_wrist.reference.minimum_jerk import minimum_jerk

LOW_BAND = (0.04, 0.15)
HIGH_BAND = (0.15, 0.40)
"""Bands of heart-rate variability [Hz] (Task Force of the ESC and the NASPE, European Heart Journal 17, 1996)."""
TONES = 8
"""Tones in a band."""


class Tones(NamedTuple):
    """The variability of a heart rate: its share Σ B cos(2π ν t + θ).

    Attributes:
        size: B, relative to the mean rate.
        frequency: ν [Hz].
        phase: θ [rad].
    """

    size: Array
    frequency: Array
    phase: Array


def variability(rate: float, deviation: float, low_to_high: float, seed: int) -> Tones:
    """Return tones with which the intervals between beats have a standard deviation.

    Each band gets one random frequency in each of its equal slices, of random phase and equal size. An interval T is
    the time over which the rate integrates to one beat, T ≈ T₀ − T₀ Σ B sinc(ν T₀) cos(…), with T₀ = 1/rate and
    sinc x = sin(πx)/(πx), so that to first order Var T = T₀² Σ B² sinc²(ν T₀) / 2, which fixes B.

    Args:
        rate: mean heart rate [Hz].
        deviation: standard deviation of the intervals [s], SDNN.
        low_to_high: power of the low band over that of the high band.
        seed: of the frequencies and phases.
    """
    random = np.random.default_rng(seed)
    shares = (low_to_high / (1.0 + low_to_high), 1.0 / (1.0 + low_to_high))
    sizes, frequencies = [], []
    for (low, high), share in zip((LOW_BAND, HIGH_BAND), shares, strict=True):
        frequency = low + (high - low) * (np.arange(TONES) + random.random(TONES)) / TONES
        size = deviation * rate * np.sqrt(2.0 * share / np.sum(np.sinc(frequency / rate) ** 2))
        sizes.append(np.full(TONES, size))
        frequencies.append(frequency)
    phase = 2.0 * np.pi * random.random(2 * TONES)
    return Tones(np.concatenate(sizes), np.concatenate(frequencies), phase)


def sinus_rhythm(time: Array, rate: float, tones: Tones) -> Jet:
    """Return beats since t = 0, as a continuous number: rate·(t + Σ B (sin(2π ν t + θ) − sin θ) / (2π ν))."""
    beats, pace, change = time.copy(), np.ones_like(time), np.zeros_like(time)
    for size, frequency, phase in zip(*tones, strict=True):
        omega = 2.0 * np.pi * frequency
        argument = omega * time + phase
        sine = np.sin(argument)
        beats += size / omega * (sine - np.sin(phase))
        pace += size * np.cos(argument)
        change -= size * omega * sine
    return Jet(beats, pace, change).scaled(rate)


def with_premature_beats(beats: Jet, probability: float, coupling: float, seed: int) -> Jet:
    """Return the same number of beats, but that some come early and are followed by a full compensatory pause.

    Beats go in pairs 2m, 2m + 1. The second of a pair is premature with twice ``probability``: it comes when the
    fraction c = ``coupling`` of the interval has passed, and the beat after it when it would have come anyway, as the
    sinus node keeps its time: both intervals together make two normal ones, the definition of a full compensatory
    pause. With x the number of beats since 2m and M the minimum-jerk polynomial, the number becomes

        2m + x + (1 − c) [M(x/c) − M((x − c)/(2 − c))],

    which grows all the time and has continuous second derivatives, within a pair and from pair to pair. Whether a pair
    has a premature beat is drawn from its number by a counter-based generator (Philox): the same however the time is
    cut into pieces.

    Args:
        beats: number of beats of the undisturbed rhythm.
        probability: share of the beats that are premature, at most 1/2.
        coupling: c, from 0 to 1.
        seed: of the draws.
    """
    if probability == 0.0:
        return beats
    pair = np.floor(0.5 * beats.value)
    x = beats.value - 2.0 * pair
    early = (1.0 - coupling) * (_uniform(pair, seed) < 2.0 * probability)
    rest = 2.0 - coupling
    forward, back = minimum_jerk(x / coupling), minimum_jerk((x - coupling) / rest)
    return beats.through(
        beats.value + early * (forward.way - back.way),
        1.0 + early * (forward.speed / coupling - back.speed / rest),
        early * (forward.change / coupling**2 - back.change / rest**2),
    )


def _uniform(counters: Array, seed: int) -> Array:
    """Return for each whole number a number of its own in [0, 1); 1 for those below zero, before the first beat."""
    numbers, places = np.unique(counters, return_inverse=True)
    drawn = [
        np.random.Generator(np.random.Philox(key=seed, counter=int(number))).random() if number >= 0.0 else 1.0
        for number in numbers
    ]
    return np.array(drawn)[places] if len(numbers) else np.empty(0)
