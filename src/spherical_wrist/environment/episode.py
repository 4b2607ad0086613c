"""One episode: a closed loop at its start, its inputs piece by piece, and where all of it lies."""

from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.environment.play import ROW
from spherical_wrist.environment.task import Task
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.measured import closed_loop
from spherical_wrist.metrics import LogMeter
from spherical_wrist.simulation.addresses import laid, where
from spherical_wrist.simulation.bulk import lay
from spherical_wrist.simulation.loop import LOG
from spherical_wrist.simulation.workbench import Machine, Workbench

Array = npt.NDArray[np.float64]

PIECE = 512
"""Control periods whose inputs are drawn at a time, which bounds the memory of an episode however long it is."""


class Episode:
    """An episode, kept alive for what is played through its row.

    Args:
        experiment: what is played.
        task: what episodes have in common.
        bench: what they share on a thread.
        machine: plant and nominal model.
        parameters: the packed parameters of the law, which actions are written into.

    Attributes:
        experiment: what is played.
        loop: the closed loop.
        samples: control periods in the whole episode.

    Raises:
        WristError: the experiment cannot be run.
    """

    def __init__(
        self, experiment: Experiment, task: Task, bench: Workbench, machine: Machine, parameters: Array
    ) -> None:
        self.experiment, self._task = experiment, task
        self._timing = experiment.timing(task.nominal)
        self.samples = self._timing.samples
        self.loop = closed_loop(experiment, bench, machine=lambda timing: machine)
        self._meter = LogMeter(experiment.measurement(task.nominal), bench.engine)
        self._parameters, self._drawn = parameters, 0
        self._inputs = self.loop.draw(0, self._next())
        parts = self.loop.parts
        frame = task.frame_skip
        self._made = (
            parts.sensor.settings.copy(),
            np.empty(frame, LOG),
            np.empty((frame, experiment.law.state_size)),
            np.empty((frame, len(parts.drive.coils))),
        )

    def _next(self) -> int:
        """The instant after those that are drawn next: there is one more than periods, for the last observation."""
        self._drawn = min(self._drawn + max(PIECE, self._task.frame_skip) + 1, self.samples + 1)
        return self._drawn

    def row(self) -> npt.NDArray[Any]:
        """The episode at its start, a ROW array of length one."""
        found, parts, task = np.zeros(1, ROW), self.loop.parts, self._task
        row, meter, (scratch, log, states, currents) = found[0], self._meter, self._made
        parts = parts._replace(parameters=self._parameters)
        lay(row["run"], parts, log, states, currents, meter.window, meter.totals)
        row["scratch"] = where(scratch)
        row["left"], row["frame"] = self.samples, task.frame_skip
        gravity = task.nominal.model.opt.gravity @ task.nominal.mount
        row["gravity"] = gravity / (np.linalg.norm(gravity) or 1.0)
        row["lever"] = task.nominal.lever
        pay, limits = task.reward, task.limits
        row["weights"] = pay.tip, pay.effort, pay.chattering
        row["scales"] = pay.tip_scale, pay.effort_scale, pay.chattering_scale
        row["most_tip_error"], row["most_error"] = limits.tip_error_mm or np.inf, limits.error_rad or np.inf
        self._place(row)
        return found

    def refill(self, row: Any) -> None:
        """Draws the next inputs, and drops those before the present instant."""
        first = self._drawn
        later = self.loop.draw(first, self._next())
        self._inputs = self._inputs.then(later, int(row["offset"]), self._timing.substeps)
        self._place(row)

    def _place(self, row: Any) -> None:
        row["run"]["inputs"] = laid(self._inputs)
        row["offset"] = 0

    def conclude(self, left: int, result: Any) -> dict[str, Any]:
        """What came of the episode, as an info: its metrics, and how it ended.

        Args:
            left: control periods that were not played.
            result: the RESULT record of the last frame.

        Raises:
            LawError: the law wrote a torque that is not finite.
        """
        self.loop.conclude(self.samples - left - self.loop.sample, int(result["status"]))
        metrics = {name: value for name, value in asdict(self._meter.result()).items() if value is not None}
        ended = self.loop.outcome
        if ended is None or (result["beyond"] and ended.status == "completed"):
            return {"metrics": metrics, "outcome": "out_of_bounds", "reason": self._beyond(result)}
        return {"metrics": metrics, "outcome": str(ended.status), "reason": ended.reason}

    def _beyond(self, result: Any) -> str:
        limits, error = self._task.limits, float(np.linalg.norm(result["error"]))
        bounds = ", ".join(f"{name} = {value:g}" for name, value in limits if value is not None)
        return f"beyond {bounds} within the last frame, at whose end {result['tip_error_mm']:.4g} mm, {error:.4g} rad"
