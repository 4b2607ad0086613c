"""Rollout of one episode: closed loop, inputs in chunks, and record for compiled code."""

from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.environment.step import EPISODE_RECORD
from spherical_wrist.environment.task import Task
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.embedded_files import EmbeddedFiles, description_of
from spherical_wrist.loop.addresses import array_address, array_addresses
from spherical_wrist.loop.loop import LOG
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.loop.rollout import LogMemory, fill_run_record
from spherical_wrist.measure.logged import Logged, channels_of
from spherical_wrist.measure.series import Series
from spherical_wrist.measure.warnings import warnings_of, without_repeats
from spherical_wrist.prepare.cache import Models, RunCache
from spherical_wrist.prepare.closed_loop import prepare
from spherical_wrist.simulation.metric_accumulator import MetricAccumulator
from spherical_wrist.simulation.run import AGENT, Run, circumstances

INPUT_CHUNK = 512
"""Control periods whose inputs are sampled together. Chunks bound the memory of an episode of any duration."""


class EpisodeRollout:
    """Episode in progress. It owns the arrays whose addresses are in its record.

    Args:
        experiment: experiment of the episode.
        task: task of the environment.
        cache: cache of the thread.
        models: plant and nominal model.
        parameters: packed parameters of the law, which actions are written to.
        keeps_series: True to keep the series of the episode, for :meth:`run`.

    Attributes:
        experiment: experiment of the episode.
        loop: closed loop.
        samples: number of control periods in the whole episode.

    Raises:
        WristError: the experiment cannot be run.
    """

    def __init__(
        self,
        experiment: Experiment,
        task: Task,
        cache: RunCache,
        models: Models,
        parameters: Array,
        keeps_series: bool = False,
    ) -> None:
        self.experiment, self._task = experiment, task
        self._timing = experiment.timing(task.nominal)
        self.samples = self._timing.samples
        self.loop = prepare(experiment, cache, models=models)
        self._metrics = MetricAccumulator(experiment.measurement(task.nominal), cache.engine)
        self._parameters, self._drawn = parameters, 0
        self._inputs = self.loop.draw(0, self._next())
        parts = self.loop.parts
        periods = task.frame_skip
        self._sensor_copy, self._memory = (
            parts.sensor.settings.copy(),
            LogMemory(np.empty(periods, LOG), *(np.empty((periods, width)) for width in self.loop.widths)),
        )
        self._kept: list[Series] | None = [Series.empty()] if keeps_series else None
        self._offset = 0

    def _next(self) -> int:
        """Return the end of the next chunk of inputs, which has one more instant for the last observation."""
        self._drawn = min(self._drawn + max(INPUT_CHUNK, self._task.frame_skip) + 1, self.samples + 1)
        return self._drawn

    def initial_record(self) -> npt.NDArray[Any]:
        """Return the episode at its initial state, as an EPISODE_RECORD array of length one."""
        records, parts, task = np.zeros(1, EPISODE_RECORD), self.loop.parts, self._task
        record, metrics = records[0], self._metrics
        parts = parts._replace(parameters=self._parameters)
        fill_run_record(record["run"], parts, self._memory, metrics.settings, metrics.totals)
        record["sensor_copy"] = array_address(self._sensor_copy)
        record["remaining"], record["frame_skip"] = self.samples, task.frame_skip
        gravity = task.nominal.model.opt.gravity @ task.nominal.mount
        record["gravity"] = gravity / (np.linalg.norm(gravity) or 1.0)
        record["lever"] = task.nominal.lever
        reward, limits = task.reward, task.limits
        record["weights"] = reward.tip, reward.effort, reward.chattering
        record["scales"] = reward.tip_scale, reward.effort_scale, reward.chattering_scale
        record["max_tip_error"], record["max_error"] = limits.tip_error_mm or np.inf, limits.error_rad or np.inf
        self._write_inputs(record)
        return records

    def refill(self, record: Any) -> None:
        """Sample the next inputs, and drop those before the present instant."""
        first = self._drawn
        later = self.loop.draw(first, self._next())
        self._inputs = self._inputs.then(later, int(record["offset"]), self._timing.substeps)
        self._write_inputs(record)

    def _write_inputs(self, record: Any) -> None:
        record["run"]["inputs"] = array_addresses(self._inputs)
        record["offset"] = self._offset = 0

    def keep_rows(self, offset: int) -> None:
        """Keep the rows that the last step logged.

        Args:
            offset: row of the present instant in the inputs.
        """
        if self._kept is None or offset == self._offset:
            return
        first, self._offset = self._offset, offset
        experiment = self.experiment
        channels = channels_of(experiment.law, experiment.sensing, experiment.actuation)
        self._kept.append(self._logged(first, offset - first).series(self.loop.wrist, channels))

    def _logged(self, first: int, count: int) -> Logged:
        """Return the rows that a call logged, from a row of the inputs on."""
        inputs, rows = self._inputs, slice(first, first + count)
        disturbance = inputs.disturbance[:: self._timing.substeps]
        return Logged(
            inputs.time[rows], inputs.desired[rows], disturbance[rows], *(array[:count] for array in self._memory)
        )

    def run(self) -> Run:
        """Return the episode so far as a run, in which an agent has the place of the law.

        Raises:
            ParameterError: the series was not kept.
        """
        if self._kept is None:
            raise ParameterError("the episode was not recorded: make the environment with record=True")
        task, files = self._task, EmbeddedFiles.of(self.experiment)
        series = Series.joined(self._kept)
        law = {"name": AGENT, "action": "gains" if task.actions.factor else "torque", "numbers": task.actions.names}
        time = float(series.time[-1]) + self._timing.control_period if len(series) else 0.0
        metrics = self._metrics.result()
        return Run(
            channels=series.channels,
            described=series.described,
            description={**description_of(self.experiment, files), "law": law},
            outcome=self.loop.outcome or Outcome(Status.INTERRUPTED, time, "the episode was ended, or goes on"),
            metrics=metrics,
            measurement=self.experiment.measurement(task.nominal),
            versions=circumstances(),
            warnings=without_repeats((*self.loop.warnings, *warnings_of(metrics))),
            embedded_files=files,
            _experiment=self.experiment,
        )

    def record_fault(self, record: Any) -> None:
        """Count the periods of a call in which the law raised, and add them to the metrics.

        Their number follows from the time that the law was told.

        Args:
            record: EPISODE_RECORD of this episode, updated.
        """
        signal, settings = self.loop.parts.signal[0], self.loop.parts.settings[0]
        done = round(float(signal["time"] / settings["period"])) - int(settings["first"])
        self._metrics.add(self._logged(int(record["offset"]), done))
        settings["first"] += done
        record["offset"] += done
        record["remaining"] -= done

    def final_info(self, remaining: int, result: Any, fault: Exception | None = None) -> dict[str, Any]:
        """End the episode, and return the info of its last step: metrics, outcome, and reason.

        Args:
            remaining: control periods that were not simulated.
            result: STEP_RESULT record of the last step.
            fault: exception that the law raised.

        Raises:
            LawError: the law raised, or wrote a torque that is not finite, at the first instant.
        """
        self.loop.record_progress(self.samples - remaining - self.loop.sample, int(result["status"]), fault)
        metrics = {name: value for name, value in self._metrics.result().items() if value is not None}
        outcome = self.loop.outcome
        if outcome is None or (result["out_of_bounds"] and outcome.status == "completed"):
            return {"metrics": metrics, "outcome": "out_of_bounds", "reason": self._out_of_bounds_reason(result)}
        return {"metrics": metrics, "outcome": str(outcome.status), "reason": outcome.reason}

    def _out_of_bounds_reason(self, result: Any) -> str:
        limits, error = self._task.limits, float(np.linalg.norm(result["error"]))
        bounds = ", ".join(f"{name} = {value:g}" for name, value in limits if value is not None)
        return f"beyond {bounds} within the last step; at its end {result['tip_error_mm']:.4g} mm, {error:.4g} rad"
