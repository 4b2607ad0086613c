"""The environment with one wrist."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Space
from gymnasium.utils import EzPickle

from spherical_wrist.environment.fleet import Fleet
from spherical_wrist.environment.spaces import action_space, observation_space, render_mode_of
from spherical_wrist.environment.task import Task
from spherical_wrist.environment.view import View
from spherical_wrist.experiment.description import Experiment

Array = npt.NDArray[np.float64]

RENDER_MODES = ["rgb_array"]


class TrackEnv(gymnasium.Env[npt.NDArray[Any], npt.NDArray[Any]], EzPickle):
    """Follow a reference: an agent in the place of the control law.

    An episode is an experiment: it lasts its ``duration``, at whose end it is truncated, and it is terminated where the
    wrist diverges or goes beyond a limit. Every control period of it goes through the loop of ``simulate``: with
    ``action="gains"`` and an action of zeros throughout, an episode is ``simulate(env.unwrapped.experiment)`` bit for
    bit. The same seed and the same actions give the same bits.

    ``info`` has the ``time`` [s] and, of the true wrist, the ``error`` [rad] and ``rate_error`` [rad/s] in the body
    frame, the ``tip_error_mm``, and the ``torque`` that the motors delivered in the last control period [N·m]. At the
    beginning of an episode it has what was ``randomized``, if anything was; at its end its ``metrics`` by name, those
    of ``simulate`` but for what is None, the ``outcome`` (``completed``, ``diverged`` or
    ``out_of_bounds``), and the ``reason`` for the latter two.

    Args:
        experiment: an experiment, a table of its values, or an experiment file; the default one where none is given.
            Its law is the one whose gains are set.
        action: ``"torque"`` or ``"gains"``; see :mod:`spherical_wrist.environment.action`.
        frame_skip: control periods that an action is held for.
        randomize: ranges of parameters that are drawn anew for every episode, by dotted name; see
            :meth:`spherical_wrist.environment.randomize.Randomization.of`. Where nothing is given all episodes are the
            same experiment, noise of the sensors included: draw the ``seed`` for noise that differs.
        reward: weights and scales; see :mod:`spherical_wrist.environment.reward`.
        terminate_beyond: ``tip_error_mm`` and ``error_rad``, true errors at which an episode ends.
        gains: names of the gains that are set; all of them where nothing is given.
        gain_factor: the largest that a gain is multiplied or divided by.
        render_mode: ``"rgb_array"`` for pictures by :meth:`render`, which need OpenGL but no screen.

    Attributes:
        observation_names: names of the numbers of an observation; see :mod:`spherical_wrist.environment.observation`.
        observation_units: their units.
        action_names: names of the numbers of an action.
        experiment: that of the present episode.

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
    ) -> None:
        given = (experiment, action, frame_skip, randomize, reward, terminate_beyond, gains, gain_factor)
        EzPickle.__init__(self, *given, render_mode)
        self._task = Task.of(*given)
        self.render_mode = render_mode_of(render_mode, RENDER_MODES)
        frame = self._task.frame_skip * self._task.experiment.control_period
        self.metadata = {**self.metadata, "render_fps": 1.0 / frame}
        self._view = View(self._task.nominal)
        self._fleet = Fleet(self._task, 1)
        self.action_space: Space[npt.NDArray[Any]] = action_space(self._task)
        self.observation_space: Space[npt.NDArray[Any]] = observation_space(self._task)
        self.observation_names, self.observation_units = self._task.observation_names, self._task.observation_units
        self.action_names = self._task.actions.names
        self.experiment = self._task.experiment
        self._over = True

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begins an episode; there are no options.

        Raises:
            WristError: what was drawn makes no experiment that can be run.
        """
        super().reset(seed=seed)
        self.experiment, drawn = self._task.episode(self.np_random)
        fleet = self._fleet
        fleet.begin({0: self.experiment})
        self._over = False
        return fleet.observations[0].copy(), fleet.info(0) | ({"randomized": drawn} if drawn else {})

    def step(self, action: npt.NDArray[Any]) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Holds an action for a frame.

        Raises:
            ResetNeeded: the episode is over, or has not begun.
            ParameterError: the action has another shape, or is not finite.
            LawError: the law raises, or writes a torque that is not finite.
        """
        if self._over:
            raise ResetNeeded("there is no episode, or it is over: call reset() first")
        fleet = self._fleet
        fleet.play(np.asarray(action)[None])
        result, info = fleet.results[0], fleet.info(0)
        self._over = 0 in fleet.infos
        ends = bool(result["terminated"]), bool(result["truncated"])
        return fleet.observations[0].copy(), float(result["reward"]), *ends, info | fleet.infos.get(0, {})

    def render(self) -> Any:
        """A picture (480, 640, 3) of the wrist now, with a ghost where it is to be; None without a render mode.

        Raises:
            ResetNeeded: no episode has begun.
            FilmError: there is no OpenGL here.
        """
        if self.render_mode is None:
            return None
        if not self._fleet.episodes:
            raise ResetNeeded("there is nothing to see yet: call reset() first")
        attitude = self._fleet.episodes[0].loop.parts.plant.qpos
        return self._view.picture(attitude.copy(), self._fleet.info(0)["error"])

    def close(self) -> None:
        """Ends what the environment has running."""
        self._view.close()
        self._fleet.close()
