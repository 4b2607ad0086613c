"""Batch of episodes, each with its own plant, stepped together in one compiled call."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.environment.episode_rollout import EpisodeRollout
from spherical_wrist.environment.observation import MEASURED_SIZE
from spherical_wrist.environment.step import EPISODE_RECORD, INFO, STEP_RESULT, step_episodes
from spherical_wrist.environment.task import Task, check_count
from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.loop.compiler import entry
from spherical_wrist.loop.loop import RAISED
from spherical_wrist.loop.rollout import UNFINISHED
from spherical_wrist.prepare.cache import Models, RunCache
from spherical_wrist.prepare.nominal import NominalModel
from spherical_wrist.prepare.plant import PlantModel


class EpisodeBatch:
    """Batch of episodes of one task.

    Args:
        task: settings that all episodes share.
        num_envs: number of environments.
        threads: number of threads among which the environments are divided.
        keeps_series: True to keep the series of the present episodes.

    Attributes:
        results: results of the last step, STEP_RESULT (num_envs,).
        observations: present observations, (num_envs, size of an observation).
        episodes: present or last episode of each environment, by index.
        infos: final infos of the episodes that ended in the last step, by index.

    Raises:
        WristError: the law cannot be compiled, or MuJoCo cannot step the wrist.
    """

    def __init__(self, task: Task, num_envs: int, threads: int = 1, *, keeps_series: bool = False) -> None:
        check_count("num_envs", num_envs)
        check_count("threads", threads)
        self._task, self._cache, self._keeps_series = task, RunCache(), keeps_series
        timing, threads = task.experiment.timing(task.nominal), min(threads, num_envs)
        plant = PlantModel(task.nominal, timing.physics_period)
        self._plants = [plant, *(plant.copy() for _ in range(num_envs - 1))]
        # each thread has its own nominal model, because its data is working memory
        nominals = [NominalModel(task.nominal, timing, self._cache.engine) for _ in range(threads)]
        self._nominals = [nominals[index * threads // num_envs] for index in range(num_envs)]
        ends = [-(-num_envs * thread // threads) for thread in range(threads + 1)]
        self._thread_slices = [slice(first, last) for first, last in pairwise(ends)]
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self._packed = np.tile(task.actions.law.packed(timing.control_period), (num_envs, 1))
        self._records, self._samples = np.zeros(num_envs, EPISODE_RECORD), np.zeros(num_envs, dtype=np.int64)
        self.results = np.zeros(num_envs, STEP_RESULT)
        self.observations = np.zeros((num_envs, MEASURED_SIZE + len(task.actions.names)))
        self._compiled = entry(step_episodes, EPISODE_RECORD, STEP_RESULT, np.float64)
        self._calls: dict[tuple[int, int], Callable[[], Any]] = {}
        self._faults: dict[int, Exception] = {}
        self.episodes: dict[int, EpisodeRollout] = {}
        self.infos: dict[int, dict[str, Any]] = {}
        self._given: set[str] = set()

    @property
    def time(self) -> Array:
        """Simulated time of each episode [s], (num_envs,)."""
        time: Array = (self._samples - self._records["remaining"]) * self._task.experiment.control_period
        return time

    @property
    def batched_info(self) -> dict[str, Array]:
        """Infos of all environments, one array for each name."""
        return {"time": self.time, **{name: self.results[name] for name, *_ in INFO}}

    def info(self, index: int) -> dict[str, Any]:
        """Return the info of one environment."""
        taken = {name: values[index] for name, values in self.batched_info.items()}
        return {name: value.copy() if value.ndim else float(value) for name, value in taken.items()}

    def reset(self, experiments: Mapping[int, Experiment]) -> None:
        """Begin new episodes. Doubts about their model or motion are Python warnings.

        Args:
            experiments: experiments of the new episodes, by index of the environment.

        Raises:
            WristError: an experiment cannot be run.
        """
        self._records["periods"] = -1  # skips the other episodes
        for index, experiment in experiments.items():
            plant, nominal = self._plants[index], self._nominals[index]
            plant.perturb(experiment.perturbation)
            models = Models(self._task.nominal, plant.model, plant.data, nominal)
            self.episodes[index] = EpisodeRollout(
                experiment, self._task, self._cache, models, self._packed[index], self._keeps_series
            )
            self._warn(self.episodes[index].loop.warnings)
            self._records[index] = self.episodes[index].initial_record()[0]
            self._samples[index] = self.episodes[index].samples
            self.observations[index] = 0.0
        self._run()

    def _warn(self, texts: Sequence[str]) -> None:
        """Give each warning about the model or the motion once."""
        for text in texts:
            if text not in self._given:
                self._given.add(text)
                warnings.warn(text, RuntimeWarning, stacklevel=4)

    def step(self, actions: npt.ArrayLike, skipped: npt.NDArray[np.bool_] | None = None) -> None:
        """Hold an action on each environment for ``frame_skip`` control periods, or to the end of its episode.

        Args:
            actions: actions (num_envs, k).
            skipped: mask (num_envs,) of environments that are not stepped, whose actions are ignored; by default none.

        Raises:
            ParameterError: the actions have another shape, or are not finite.
            LawError: the law raises, or writes a torque that is not finite, at the first instant of an episode.
        """
        clipped, frame_skip = self._clipped(actions, skipped), self._task.frame_skip
        self._records["periods"] = frame_skip if skipped is None else np.where(skipped, -1, frame_skip)
        self._task.actions.write(clipped, self._packed)
        changed = self._run()
        if self._keeps_series:
            for index, episode in self.episodes.items():
                episode.keep_rows(int(self._records[index]["offset"]))
        self.observations[:, MEASURED_SIZE:] = clipped
        self.infos = {}
        if changed:
            self._update_episodes()

    def _update_episodes(self) -> None:
        """Collect the infos of episodes that have ended, and sample inputs for those that need more."""
        results = self.results
        for index in map(int, np.flatnonzero(results["terminated"] | results["truncated"])):
            remaining, fault = int(self._records[index]["remaining"]), self._faults.get(index)
            self.infos[index] = self.episodes[index].final_info(remaining, results[index], fault)
        for index in map(int, np.flatnonzero(results["needs_inputs"])):
            self.episodes[index].refill(self._records[index])

    def close(self) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _clipped(self, actions: npt.ArrayLike, skipped: npt.NDArray[np.bool_] | None) -> Array:
        """Return the actions, clipped to ±1; zeros for skipped environments."""
        try:
            given = np.array(actions, dtype=np.float64)
        except (TypeError, ValueError):
            given = np.empty(0)
        if given.shape != (len(self._records), len(self._task.actions.names)):
            raise ParameterError(
                f"action = {one_line(actions, 60)}: {len(self._task.actions.names)} numbers are needed for each wrist "
                f"({', '.join(self._task.actions.names)})"
            )
        if skipped is not None:
            given[skipped] = 0.0
        if not np.isfinite(given).all():
            raise ParameterError(f"action = {one_line(given.tolist(), 60)}: must be finite numbers")
        return np.minimum(1.0, np.maximum(-1.0, given, out=given), out=given)

    def _run(self) -> int:
        """Run all episodes, and return how many have ended or need more inputs."""
        self._faults.clear()
        with warnings_kept_in_data():
            return sum((self._pool.map if self._pool else map)(self._run_slice, self._thread_slices))

    def _run_slice(self, part: slice) -> int:
        """Run the episodes of one thread; one whose law raises ends, and the others go on."""
        try:
            return int(self._call(part)())
        except Exception as error:  # only a law can raise in the loop, and it can raise anything
            failed = part.start + int((self.results["status"][part] == UNFINISHED).argmax())
            record, result, alone = self._records[failed], self.results[failed], slice(failed, failed + 1)
            self._faults[failed] = error
            self.episodes[failed].record_fault(record)
            record["periods"] = 0  # only its result and observation are written
            self._call(alone)()
            result["status"], result["terminated"], result["needs_inputs"] = RAISED, True, False
            return self._changed(slice(part.start, failed)) + 1 + self._run_rest(slice(failed + 1, part.stop))

    def _run_rest(self, part: slice) -> int:
        return self._run_slice(part) if part.start < part.stop else 0

    def _changed(self, part: slice) -> int:
        """Count the episodes that have ended or need more inputs."""
        results = self.results[part]
        return int((results["terminated"] | results["truncated"] | results["needs_inputs"]).sum())

    def _call(self, part: slice) -> Callable[[], Any]:
        """Return the compiled step of some episodes; that of a thread is kept, because making it takes time."""
        key = part.start, part.stop
        if key not in self._calls:
            arrays = (self._records, self.results, self.observations)
            self._calls[key] = self._compiled.bound(*(array[part] for array in arrays))
        return self._calls[key]
