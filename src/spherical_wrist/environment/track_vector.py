"""The environment with many wrists, stepped together in compiled code."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.utils import EzPickle, seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from spherical_wrist.environment.fleet import Fleet
from spherical_wrist.environment.spaces import (
    action_space,
    autoreset_mode_of,
    mask_of,
    observation_space,
    render_mode_of,
    seeds_of,
)
from spherical_wrist.environment.task import Task
from spherical_wrist.experiment.description import Experiment

Array = npt.NDArray[np.float64]
Truths = npt.NDArray[np.bool_]


class TrackVectorEnv(VectorEnv[Array, npt.NDArray[Any], npt.NDArray[Any]], EzPickle):
    """Many wrists that follow a reference; each is a :class:`spherical_wrist.environment.track.TrackEnv`.

    Given the same seeds and actions, wrist i goes through the same bits as the i-th of a ``SyncVectorEnv``, and
    observations, rewards and infos are those that it would give. A step is one call of compiled code, however many
    wrists there are.

    Args:
        num_envs: how many.
        autoreset_mode: when a wrist whose episode is over begins the next one: ``"NextStep"``, in the step after, whose
            action does not count; ``"SameStep"``, at once, with the last observation and info in ``final_obs`` and
            ``final_info``; or ``"Disabled"``, by ``reset`` with ``options={"reset_mask": …}``.
        threads: that share the wrists; worth it from some hundred control periods a step on.
        experiment: this and all that follows as for one wrist.
        action: see there.
        frame_skip: see there.
        randomize: see there.
        reward: see there.
        terminate_beyond: see there.
        gains: see there.
        gain_factor: see there.
        render_mode: None: pictures are a single wrist's.

    Attributes:
        observation_names: names of the numbers of an observation.
        observation_units: their units.
        action_names: names of the numbers of an action.
        experiments: those of the present episodes.

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
    ) -> None:
        given = (experiment, action, frame_skip, randomize, reward, terminate_beyond, gains, gain_factor)
        EzPickle.__init__(self, num_envs, autoreset_mode, threads, *given, render_mode)
        self._task = Task.of(*given)
        render_mode_of(render_mode, [])
        self._mode = autoreset_mode_of(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
        self._fleet = Fleet(self._task, num_envs, threads)
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
        """Begins an episode on every wrist, or on those of ``options["reset_mask"]``, an array of booleans.

        Args:
            seed: of the first wrist, the next ones having the numbers after it; or one of each.
            options: see above.

        Raises:
            ParameterError: there are not as many seeds as wrists, or the mask is none.
            WristError: what was drawn makes no experiment that can be run.
        """
        mask = mask_of(options, self.num_envs)
        for i, each in enumerate(seeds_of(seed, self.num_envs)):
            if mask[i] and (each is not None or i not in self._generators):
                self._generators[i] = seeding.np_random(each)[0]
        drawn = self._begin(mask)
        self._over &= ~mask
        return self._fleet.observations.copy(), self._told(drawn, mask)

    def step(self, actions: npt.NDArray[Any]) -> tuple[Array, Array, Truths, Truths, dict[str, Any]]:
        """Holds an action (n, k) on each wrist for a frame.

        Raises:
            ResetNeeded: there are no episodes yet, or, where the next ones are not begun by themselves, one is over.
            ParameterError: the actions have another shape, or are not finite.
            LawError: the law raises, or writes a torque that is not finite.
        """
        fleet, over = self._fleet, self._over
        if len(fleet.episodes) < self.num_envs or (self._mode is AutoresetMode.DISABLED and over.any()):
            raise ResetNeeded("an episode has not begun, or is over: call reset() first")
        fleet.play(actions, over if over.any() else None)
        rewards = np.where(over, 0.0, fleet.results["reward"])
        terminated, truncated = fleet.results["terminated"].copy(), fleet.results["truncated"].copy()
        ended = terminated | truncated
        told, again = dict(fleet.infos), over
        if self._mode is AutoresetMode.SAME_STEP:
            told, again = {seat: self._final(seat) for seat in fleet.infos}, ended
        for seat, drawn in self._begin(again).items():
            told[seat] = told.get(seat, {}) | drawn
        self._over = ended & ~again
        return fleet.observations.copy(), rewards, terminated, truncated, self._told(told)

    def _begin(self, mask: Truths) -> dict[int, dict[str, Any]]:
        """Begins episodes; what was drawn for them, as infos."""
        if not mask.any():
            return {}
        found = {seat: self._task.episode(self._generators[seat]) for seat in map(int, np.flatnonzero(mask))}
        self._fleet.begin({seat: experiment for seat, (experiment, _) in found.items()})
        for seat, (experiment, _) in found.items():
            self.experiments[seat] = experiment
        return {seat: {"randomized": drawn} for seat, (_, drawn) in found.items() if drawn}

    def _final(self, seat: int) -> dict[str, Any]:
        """What is told of an episode in the step in which the next one begins."""
        info = self._fleet.info(seat) | self._fleet.infos[seat]
        return {"final_obs": self._fleet.observations[seat].copy(), "final_info": info}

    def _told(self, of_some: Mapping[int, dict[str, Any]], mask: Truths | None = None) -> dict[str, Any]:
        """Infos of all wrists, or of those of a mask, and what is told of some of them besides."""
        every = np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask
        infos: dict[str, Any] = {}
        for name, value in self._fleet.truth.items():
            infos[name] = np.where(every.reshape(-1, *[1] * (value.ndim - 1)), value, 0.0)
            infos[f"_{name}"] = every.copy()
        for seat in sorted(of_some):
            infos = self._add_info(infos, of_some[seat], seat)
        return infos

    def close_extras(self, **_: Any) -> None:
        """Ends the threads."""
        self._fleet.close()
