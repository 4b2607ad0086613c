"""Margins of several laws on one experiment."""

from collections.abc import Mapping
from concurrent.futures import CancelledError
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.comparison.law_selection import Laws
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.loop.outcome import StoppedError
from spherical_wrist.prepare.closed_loop import peak_torque
from spherical_wrist.prepare.pulse_responses import NotLinearError, SettledLoop
from spherical_wrist.prepare.worst_torque import WorstTorque, worst_torque
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress
from spherical_wrist.stability.frequency_response import (
    frequencies,
    frequency_response,
    largest_gain,
)
from spherical_wrist.stability.loop_margins import LoopMargins, loop_margins
from spherical_wrist.stability.stable_range import DEVIATIONS, stable_up_to

REJECTED = 0.5**0.5
"""Sensitivity [−3 dB] up to which a disturbance counts as rejected."""


class LinearLoop(NamedTuple):
    """Linear loop of a law.

    Attributes:
        frequency: frequencies [Hz], (m,).
        sensitivity: largest singular value of S at the plant's input, (m,).
        complementary: largest singular value of T there, (m,).
        tip: largest tip displacement per torque on the joint [m/(N·m)], (m,).
        margins: margins by the place where the loop is cut: ``plant_input``, ``attitude_sensor``, and, where there is
            one, ``rate_sensor``.
        bandwidth_hz: frequency up to which S at the plant's input is below −3 dB; 0 if it never is.
        worst: worst disturbance.
        ranges: by name of :data:`.DEVIATIONS`, the largest value up to which the loop is stable; None if all are.
    """

    frequency: Array
    sensitivity: Array
    complementary: Array
    tip: Array
    margins: Mapping[str, LoopMargins]
    bandwidth_hz: float
    worst: WorstTorque
    ranges: Mapping[str, float | None]


class LawMargins(NamedTuple):
    """Margins of a law.

    Attributes:
        law: label of the law.
        experiment: experiment.
        size: bound of the disturbance on every axis [N·m].
        linear: linear loop; None if there is none.
        reason: reason why there is none; empty otherwise.
    """

    law: str
    experiment: Experiment
    size: float
    linear: LinearLoop | None
    reason: str = ""

    @property
    def worst_tip_error_mm(self) -> float | None:
        """Largest tip error that a disturbance within its bound can cause, by linear theory [mm]."""
        return None if self.linear is None else 1e3 * self.linear.worst.gain * self.size


def margins(
    laws: Laws,
    tables: Mapping[str, Any] | None = None,
    changes: Mapping[str, Any] | None = None,
    *,
    at: float = 0.0,
    ranges: bool = True,
    jobs: int | None = None,
    progress: Progress = ignore_progress,
) -> list[LawMargins]:
    """Linearise the compiled loop of each law about an attitude of the reference, and compute its margins.

    The loop is that of the experiment, with all that it remembers; see :mod:`spherical_wrist.prepare.pulse_responses`.

    Args:
        laws: laws by label.
        tables: experiment as plain tables; by default the default experiment.
        changes: values by dotted name that override them. Those of laws are ignored, as ``laws`` has them already.
        at: time of the reference whose attitude is held [s].
        ranges: True to search for the masses, payloads and delays up to which each loop is stable.
        jobs: number of threads; None for the number of cores.
        progress: called with the number of finished laws and their total.

    Returns:
        Margins, in the order of the laws.

    Raises:
        WristError: the experiment is not valid, its disturbance has no size, or a law raises.
        CancelledError: the work was stopped.
    """
    if not isfinite(at):
        raise ParameterError(f"at = {at} s: must be a finite time")
    shared = {name: value for name, value in (changes or {}).items() if not name.startswith("law.")}
    base = with_changes(tables or {}, shared)
    experiments = [(label, Experiment(**{**base, "law": law})) for label, law in laws.items()]

    def work(item: tuple[str, Experiment], worker: Worker) -> LawMargins:
        label, experiment = item
        try:
            return _margins_of(label, experiment, worker, at, ranges)
        except StoppedError:
            raise CancelledError from None

    return Runner(jobs).map(work, experiments, progress, lambda item: f"margins of {item[0]}")


def _margins_of(label: str, experiment: Experiment, worker: Worker, at: float, ranges: bool) -> LawMargins:
    cache, stop = worker.cache, worker.stop
    timing = experiment.timing(cache.wrist(experiment.wrist_file))
    nominal = cache.models(experiment.wrist_file, experiment.perturbation, timing).nominal
    peak = peak_torque(experiment, experiment.drawn_reference, nominal, timing, cache, stop)
    size = experiment.disturbance.size(peak)
    try:
        loop = SettledLoop(experiment, cache, at=at, stop=stop)
        torque, attitude = loop.torque_responses(), loop.attitude_responses()
        rate = loop.rate_responses() if loop.has_rate_sensor else None
    except NotLinearError as error:
        return LawMargins(label, experiment, size, None, str(error))
    period = timing.control_period
    frequency = frequencies(period)
    added = torque.command.copy()
    added[0] += np.eye(3)  # the sum of what is added and what comes back
    cuts = {"plant_input": added, "attitude_sensor": attitude.measured}
    if rate is not None:
        cuts["rate_sensor"] = rate.measured
    sensitivity = frequency_response(added, period, frequency)
    largest = largest_gain(sensitivity)
    rejected = largest < REJECTED
    found = LinearLoop(
        frequency,
        largest,
        largest_gain(np.eye(3) - sensitivity),
        largest_gain(frequency_response(torque.tip, period, frequency)),
        {place: loop_margins(pulse, period, frequency) for place, pulse in cuts.items()},
        float(frequency[rejected.argmin() - 1]) if rejected[0] else 0.0,
        worst_torque(torque.tip),
        {each.name: stable_up_to(each, experiment, cache, at, stop) for each in DEVIATIONS} if ranges else {},
    )
    return LawMargins(label, experiment, size, found)
