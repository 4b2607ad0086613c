"""Measurements of one law for the criterion, each made when it is first asked for: margins of its loop, and runs.

All are of the default wrist and motion. *Late* hardware: samples 0.5 ms old, and motors with a lag of 0.5 ms, both of
which the controller knows.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from spherical_wrist.control import Law
from spherical_wrist.errors import LawError, ParameterError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.experiment.presets import hardware
from spherical_wrist.loop.outcome import Status
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.prepare.closed_loop import peak_torque
from spherical_wrist.prepare.needed_torque import needed_variation
from spherical_wrist.prepare.pulse_responses import SettledLoop
from spherical_wrist.prepare.worst_torque import worst_torque
from spherical_wrist.simulation.runner import Worker
from spherical_wrist.stability.frequency_response import frequencies
from spherical_wrist.stability.loop_margins import LoopMargins, loop_margins

Changes = Mapping[str, Any]

MASSES = (0.5, 1.0, 1.5)
"""Mass scales of the plant that a law must bear: both ends, and the nominal one."""
IDEAL: Changes = {}
LATE: Changes = {"sensing.delay": 0.5e-3, "actuation.lag": 0.5e-3}
VERY_LATE: Changes = {"sensing.delay": 1.5e-3, "actuation.lag": 1e-3}
REALISTIC = hardware("realistic")
RETURN = 0.04
"""Initial error about each axis [rad]: 0.07 rad in all."""


def unknown_delay(seconds: float) -> Changes:
    """Return the changes for samples that are late without the controller knowing."""
    return {"sensing.delay": seconds, "sensing.timestamped": False}


class DesignTrial:
    """One law, measured as far as it is asked.

    A law that raises, refuses an experiment or has no linear loop has None for what cannot be measured.

    Args:
        law: law to be judged.
        worker: runs the experiments.
    """

    def __init__(self, law: Law, worker: Worker) -> None:
        self._law, self._worker = law, worker
        self._kept: dict[Any, Any] = {}

    def margins(self, mass: float, changes: Changes) -> LoopMargins | None:
        """Margins of the loop cut at the plant's input, at the first attitude of the motion."""
        found = self._linear(mass, changes)
        return None if found is None else found[0]

    def worst_tip(self, mass: float, changes: Changes) -> float | None:
        """Largest tip error [mm] by any torque within the disturbance's level, by linear theory."""
        found = self._linear(mass, changes)
        return None if found is None else found[1]

    def metrics(self, changes: Changes) -> Metrics | None:
        """Metrics of a run of the default experiment with changes; None if it does not complete."""
        key = "metrics", *sorted(changes.items())
        if key not in self._kept:
            try:
                found = self._worker.measure(self._experiment(changes))
                self._kept[key] = found.metrics if found.outcome.status is Status.COMPLETED else None
            except (LawError, ParameterError):
                self._kept[key] = None
        kept: Metrics | None = self._kept[key]
        return kept

    def swing_back(self, mass: float) -> float | None:
        """Largest error on the side of the start once it has been crossed, over that of the start.

        The wrist returns from ``RETURN`` about every axis to an attitude that is held, without a disturbance.
        """
        start = np.array([1.0, -1.0, 1.0])
        changes = {"mass_scale": mass, "reference.name": "hold", "disturbance.level": 0.0, "duration": 1.0,
                   "initial_error": tuple(RETURN * start)}  # fmt: skip
        try:
            run = self._worker.simulate(self._experiment(changes))
        except (LawError, ParameterError):
            return None
        if run.outcome.status is not Status.COMPLETED:
            return None
        error = run.error * start / RETURN
        crossed = np.logical_or.accumulate(error < 0.0, axis=0)
        return float(np.where(crossed, error, 0.0).max())

    def restlessness(self, changes: Changes) -> float | None:
        """Total variation of the commanded torque, over that of the torque that the plant needs for the motion.

        Both in the steady window, per axis, averaged; the needed one is by inverse dynamics of the plant. About 1 of a
        loop that follows the motion and nothing else, however heavy the plant is.
        """
        found = self.metrics(changes)
        if found is None or found.chattering_Nm_per_s is None:
            return None
        return found.chattering_Nm_per_s / needed_variation(self._experiment(changes), self._worker.cache)

    def torque_step(self) -> float | None:
        """Mean change of the commanded torque in a control period on realistic hardware, over the motors' limit."""
        found = self.metrics(REALISTIC)
        if found is None or found.chattering_Nm_per_s is None:
            return None
        experiment = self._experiment(REALISTIC)
        limit = float(np.mean(self._worker.cache.wrist(experiment.wrist_file).upper))
        return found.chattering_Nm_per_s * experiment.control_period / limit

    def _experiment(self, changes: Changes) -> Experiment:
        return Experiment(**with_changes({}, {**changes, "law": self._law}))

    def _linear(self, mass: float, changes: Changes) -> tuple[LoopMargins, float] | None:
        key = "linear", mass, *sorted(changes.items())
        if key not in self._kept:
            self._kept[key] = self._linearised(self._experiment({**changes, "mass_scale": mass}))
        kept: tuple[LoopMargins, float] | None = self._kept[key]
        return kept

    def _linearised(self, experiment: Experiment) -> tuple[LoopMargins, float] | None:
        store, stop = self._worker.cache, self._worker.stop
        timing = experiment.timing(store.wrist(experiment.wrist_file))
        try:
            found = SettledLoop(experiment, store, stop=stop).torque_responses()
        except (LawError, ParameterError):  # it does not settle, or has no derivative
            return None
        added = found.command.copy()
        added[0] += np.eye(3)
        period = timing.control_period
        nominal = store.models(experiment.wrist_file, experiment.perturbation, timing).nominal
        peak = peak_torque(experiment, experiment.drawn_reference, nominal, timing, store, stop)
        margins = loop_margins(added, period, frequencies(period))
        return margins, 1e3 * worst_torque(found.tip).gain * experiment.disturbance.size(peak)
