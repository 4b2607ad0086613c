"""Vector environment: many wrists, stepped together in compiled code."""

from collections.abc import Mapping, Sequence
from inspect import signature
from os import PathLike
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.utils import EzPickle, seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from spherical_wrist.arrays import Array
from spherical_wrist.environment.episode_batch import EpisodeBatch
from spherical_wrist.environment.spaces import (
    action_space,
    autoreset_mode_of,
    mask_of,
    observation_space,
    render_mode_of,
    seeds_of,
)
from spherical_wrist.environment.task import Task, refuse_others
from spherical_wrist.experiment.description import Experiment

BoolArray = npt.NDArray[np.bool_]


class TrackVectorEnv(VectorEnv[Array, npt.NDArray[Any], npt.NDArray[Any]], EzPickle):
    """Vector environment of many :class:`spherical_wrist.environment.track.TrackEnv`.

    With the same seeds and actions, environment i gives bit for bit the observations, rewards and infos of the i-th
    environment of a ``SyncVectorEnv``. A step is one call of compiled code for any number of environments.

    Args:
        num_envs: number of environments.
        autoreset_mode: time at which the next episode begins after the end of one. ``"NextStep"``: in the next step,
            whose action is ignored. ``"SameStep"``: in the same step, with the last observation and info in
            ``final_obs`` and ``final_info``. ``"Disabled"``: at a ``reset`` with ``options={"reset_mask": …}``.
        threads: number of threads; more than one helps from a few hundred control periods per step on.
        experiment: see ``TrackEnv``.
        action: see ``TrackEnv``.
        frame_skip: see ``TrackEnv``.
        randomize: see ``TrackEnv``.
        reward: see ``TrackEnv``.
        terminate_beyond: see ``TrackEnv``.
        gains: see ``TrackEnv``.
        gain_factor: see ``TrackEnv``.
        render_mode: None, the only mode: only a single ``TrackEnv`` renders.
        **others: none; what belongs elsewhere, such as ``law``, is refused with advice.

    Attributes:
        observation_names: names of the numbers of an observation.
        observation_units: units of the numbers of an observation.
        action_names: names of the numbers of an action.
        experiments: experiments of the present episodes.

    Raises:
        WristError: an argument is not valid; in one line.
    """

    def __init__(
        self,
        num_envs: int = 1,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        experiment: Experiment | Mapping[str, Any] | str | PathLike[str] | None = None,
        action: str = "torque",
        frame_skip: int = 1,
        randomize: Mapping[str, Any] | None = None,
        reward: Mapping[str, float] | None = None,
        terminate_beyond: Mapping[str, float] | None = None,
        gains: Sequence[str] | None = None,
        gain_factor: float = 4.0,
        render_mode: str | None = None,
        **others: Any,
    ) -> None:
        refuse_others(others, signature(TrackVectorEnv).parameters)
        given = (experiment, action, frame_skip, randomize, reward, terminate_beyond, gains, gain_factor)
        EzPickle.__init__(self, num_envs, autoreset_mode, threads, *given, render_mode)
        self._task = Task.of(*given)
        render_mode_of(render_mode, [])
        self._mode = autoreset_mode_of(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
        self._batch = EpisodeBatch(self._task, num_envs, threads)
        self.num_envs = num_envs
        self.single_action_space, self.single_observation_space = (
            action_space(self._task),
            observation_space(self._task),
        )
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.observation_names, self.observation_units = self._task.observation_names, self._task.observation_units
        self.action_names = self._task.actions.names
        self.experiments = [self._task.experiment] * num_envs
        self._generators: dict[int, np.random.Generator] = {}
        self._over = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode in every environment, or in those of ``options["reset_mask"]``, an array of booleans.

        Args:
            seed: seed of the first environment, whose successors seed the others; or a list with one for each.
            options: ``reset_mask``, or nothing.

        Raises:
            ParameterError: the number of seeds is not ``num_envs``, the mask is not valid, or there is another option.
            WristError: the drawn values give no valid experiment.
        """
        mask = mask_of(options, self.num_envs)
        for i, each in enumerate(seeds_of(seed, self.num_envs)):
            if mask[i] and (each is not None or i not in self._generators):
                self._generators[i] = seeding.np_random(each)[0]
        drawn = self._begin(mask)
        self._over &= ~mask
        return self._batch.observations.copy(), self._merged_infos(drawn, mask)

    def step(self, actions: npt.NDArray[Any]) -> tuple[Array, Array, BoolArray, BoolArray, dict[str, Any]]:
        """Hold an action in each environment, of actions (n, k), for ``frame_skip`` control periods.

        Raises:
            ResetNeeded: an episode has not begun; or one has ended, and the autoreset mode is ``"Disabled"``.
            ParameterError: the actions have a wrong shape, or are not finite.
            LawError: the law raises, or writes a torque that is not finite, at the first instant.
        """
        batch, over = self._batch, self._over
        if len(batch.episodes) < self.num_envs or (self._mode is AutoresetMode.DISABLED and over.any()):
            raise ResetNeeded("an episode has ended, or has not begun: call reset() first")
        batch.step(actions, over if over.any() else None)
        rewards = np.where(over, 0.0, batch.results["reward"])
        terminated, truncated = batch.results["terminated"].copy(), batch.results["truncated"].copy()
        ended = terminated | truncated
        infos, to_reset = dict(batch.infos), over
        if self._mode is AutoresetMode.SAME_STEP:
            infos, to_reset = {index: self._final_info(index) for index in batch.infos}, ended
        for index, drawn in self._begin(to_reset).items():
            infos[index] = infos.get(index, {}) | drawn
        self._over = ended & ~to_reset
        return batch.observations.copy(), rewards, terminated, truncated, self._merged_infos(infos)

    def _begin(self, mask: BoolArray) -> dict[int, dict[str, Any]]:
        """Begin episodes in the environments of a mask. Return the drawn values as infos, by index."""
        if not mask.any():
            return {}
        begun = {index: self._task.episode(self._generators[index]) for index in map(int, np.flatnonzero(mask))}
        self._batch.reset({index: experiment for index, (experiment, _) in begun.items()})
        for index, (experiment, _) in begun.items():
            self.experiments[index] = experiment
        return {index: {"randomized": drawn} for index, (_, drawn) in begun.items() if drawn}

    def _final_info(self, index: int) -> dict[str, Any]:
        """Return the last observation and info of an episode, for the step in which the next one begins."""
        info = self._batch.info(index) | self._batch.infos[index]
        return {"final_obs": self._batch.observations[index].copy(), "final_info": info}

    def _merged_infos(self, extra: Mapping[int, dict[str, Any]], mask: BoolArray | None = None) -> dict[str, Any]:
        """Return the infos of the environments of a mask, or of all, with extra infos of some of them, by index."""
        shown = np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask
        infos: dict[str, Any] = {}
        for name, value in self._batch.batched_info.items():
            infos[name] = np.where(shown.reshape(-1, *[1] * (value.ndim - 1)), value, 0.0)
            infos[f"_{name}"] = shown.copy()
        for index in sorted(extra):
            infos = self._add_info(infos, extra[index], index)
        return infos

    def close_extras(self, **_: Any) -> None:
        """Stop the threads."""
        self._batch.close()
