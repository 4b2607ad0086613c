"""Environment with one wrist."""

from collections.abc import Mapping, Sequence
from inspect import signature
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Space
from gymnasium.utils import EzPickle

from spherical_wrist.arrays import Array
from spherical_wrist.environment.episode_batch import EpisodeBatch
from spherical_wrist.environment.rendering import EnvironmentRenderer
from spherical_wrist.environment.spaces import action_space, check_options, observation_space, render_mode_of
from spherical_wrist.environment.task import Task, refuse_others
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.simulation.run import Run

RENDER_MODES = ["rgb_array"]


class TrackEnv(gymnasium.Env[npt.NDArray[Any], npt.NDArray[Any]], EzPickle):
    """Environment in which an agent follows a reference, in place of the control law.

    An episode is an experiment. It is truncated at the end of the experiment's ``duration``, and terminated if the
    wrist diverges or exceeds a limit. It runs through the same loop as ``simulate``: with ``action="gains"`` and
    actions of zeros, an episode is bit for bit ``simulate(env.unwrapped.experiment)``. The same seed and the same
    actions give the same bits.

    ``info`` has the ``time`` [s], the true ``error`` [rad] and ``rate_error`` [rad/s] in the body frame, the true
    ``tip_error_mm``, and the ``torque`` [N·m] that the motors delivered in the last control period. After ``reset`` it
    also has the ``randomized`` values, if there are any. At the end of an episode it also has the ``metrics`` by name,
    as ``simulate`` computes them, without those that are None; the ``outcome`` (``completed``, ``diverged``,
    ``failed`` or ``out_of_bounds``); and the ``reason`` for all but the first.

    Args:
        experiment: experiment, table of its values, or experiment file; by default the default experiment. With
            ``action="gains"``, the actions set the gains of its law.
        action: ``"torque"`` or ``"gains"``; see :mod:`spherical_wrist.environment.action`.
        frame_skip: number of control periods for which an action is held.
        randomize: distributions from which parameters are drawn for every episode, by dotted name; see
            :meth:`spherical_wrist.environment.randomize.Randomization.of`. By default all episodes are the same
            experiment with the same sensor noise: randomize the ``seed`` for different noise.
        reward: weights and scales; see :mod:`spherical_wrist.environment.reward`.
        terminate_beyond: ``tip_error_mm`` and ``error_rad``, limits of the true errors that terminate an episode.
        gains: names of the gains that the actions set; by default all.
        gain_factor: largest factor by which a gain is multiplied or divided.
        render_mode: ``"rgb_array"`` for images by :meth:`render`, which need OpenGL but no display.
        record: True to keep the series of the present episode, for :attr:`run`.
        **others: none; what belongs elsewhere, such as ``law``, is refused with advice.

    Attributes:
        observation_names: names of the numbers of an observation; see :mod:`spherical_wrist.environment.observation`.
        observation_units: units of the numbers of an observation.
        action_names: names of the numbers of an action.
        experiment: experiment of the present episode.

    Raises:
        WristError: an argument is not valid; in one line.
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": 1000.0}  # noqa: RUF012 as Gymnasium has it

    def __init__(
        self,
        experiment: Experiment | Mapping[str, Any] | str | PathLike[str] | None = None,
        action: str = "torque",
        frame_skip: int = 1,
        randomize: Mapping[str, Any] | None = None,
        reward: Mapping[str, float] | None = None,
        terminate_beyond: Mapping[str, float] | None = None,
        gains: Sequence[str] | None = None,
        gain_factor: float = 4.0,
        render_mode: str | None = None,
        record: bool = False,
        **others: Any,
    ) -> None:
        refuse_others(others, signature(TrackEnv).parameters)
        given = (experiment, action, frame_skip, randomize, reward, terminate_beyond, gains, gain_factor)
        EzPickle.__init__(self, *given, render_mode, record)
        self._task = Task.of(*given)
        self.render_mode = render_mode_of(render_mode, RENDER_MODES)
        step = self._task.frame_skip * self._task.experiment.control_period
        self.metadata = {**self.metadata, "render_fps": 1.0 / step}
        self._renderer = EnvironmentRenderer(self._task.nominal)
        self._batch = EpisodeBatch(self._task, 1, keeps_series=record)
        self.action_space: Space[npt.NDArray[Any]] = action_space(self._task)
        self.observation_space: Space[npt.NDArray[Any]] = observation_space(self._task)
        self.observation_names, self.observation_units = self._task.observation_names, self._task.observation_units
        self.action_names = self._task.actions.names
        self.experiment = self._task.experiment
        self._over = True

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin an episode. There are no options.

        Raises:
            ParameterError: there is an option.
            WristError: the drawn values give no valid experiment.
        """
        check_options(options)
        super().reset(seed=seed)
        self.experiment, drawn = self._task.episode(self.np_random)
        batch = self._batch
        batch.reset({0: self.experiment})
        self._over = False
        return batch.observations[0].copy(), batch.info(0) | ({"randomized": drawn} if drawn else {})

    def step(self, action: npt.NDArray[Any]) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold an action for ``frame_skip`` control periods.

        Raises:
            ResetNeeded: the episode has ended, or has not begun.
            ParameterError: the action has a wrong shape, or is not finite.
            LawError: the law raises, or writes a torque that is not finite, at the first instant.
        """
        if self._over:
            raise ResetNeeded("the episode has ended, or has not begun: call reset() first")
        batch = self._batch
        batch.step(np.asarray(action)[None])
        result, info = batch.results[0], batch.info(0)
        self._over = 0 in batch.infos
        ends = bool(result["terminated"]), bool(result["truncated"])
        return batch.observations[0].copy(), float(result["reward"]), *ends, info | batch.infos.get(0, {})

    @property
    def run(self) -> Run:
        """Present or last episode as a run, to be saved as a recording: ``env.unwrapped.run.save("policy.rrd")``.

        Raises:
            ResetNeeded: no episode has begun.
            ParameterError: the environment was not made with ``record=True``.
        """
        if not self._batch.episodes:
            raise ResetNeeded("no episode has begun: call reset() first")
        return self._batch.episodes[0].run()

    def render(self) -> Any:
        """Render an image (480, 640, 3) of the wrist, with a ghost at the desired attitude; None without a render mode.

        Raises:
            ResetNeeded: no episode has begun.
            FilmError: OpenGL is not available.
        """
        if self.render_mode is None:
            return None
        if not self._batch.episodes:
            raise ResetNeeded("no episode has begun: call reset() first")
        attitude = self._batch.episodes[0].loop.parts.plant.qpos
        return self._renderer.render(attitude.copy(), self._batch.info(0)["error"])

    def close(self) -> None:
        """Stop the threads, and free the renderer."""
        self._renderer.close()
        self._batch.close()
