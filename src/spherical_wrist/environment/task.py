"""What an environment is asked to be, checked: the same for one wrist and for many."""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

from spherical_wrist.campaign.episode import changed
from spherical_wrist.environment.action import Actions
from spherical_wrist.environment.observation import NAMES, UNITS
from spherical_wrist.environment.randomize import Randomization
from spherical_wrist.environment.reward import Limits, Reward
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.parameters import Parameters
from spherical_wrist.wrist import Wrist

Kind = TypeVar("Kind", bound=Parameters)


class Task(NamedTuple):
    """What episodes have in common.

    Attributes:
        experiment: what every episode starts from, under the law that the loop runs.
        nominal: the wrist that the controller believes in.
        actions: how actions become parameters of that law.
        frame_skip: control periods that an action is held for.
        randomization: what differs from episode to episode.
        reward: weights and scales.
        limits: what ends an episode.
    """

    experiment: Experiment
    nominal: Wrist
    actions: Actions
    frame_skip: int
    randomization: Randomization
    reward: Reward
    limits: Limits

    @classmethod
    def of(
        cls,
        experiment: Experiment | Mapping[str, Any] | str | PathLike[str] | None = None,
        action: str = "torque",
        frame_skip: int = 1,
        randomize: Mapping[str, Any] | None = None,
        reward: Mapping[str, float] | None = None,
        terminate_beyond: Mapping[str, float] | None = None,
        gains: Sequence[str] | None = None,
        gain_factor: float = 4.0,
    ) -> Self:
        """Checks the arguments of an environment; see :class:`spherical_wrist.environment.track.TrackEnv`.

        Raises:
            WristError: one of them is not valid; in one line.
        """
        given = _experiment(experiment)
        nominal = given.nominal()
        given.timing(nominal)
        counted("frame_skip", frame_skip)
        actions = Actions.of(action, given.law, nominal, gains, gain_factor)
        pay, limits = _table("reward", Reward, reward), _table("terminate_beyond", Limits, terminate_beyond)
        if not pay.tip + pay.effort + pay.chattering > 0.0:
            raise ParameterError("reward: one of the weights tip, effort and chattering must be positive")
        played = given.replaced(law=actions.law)
        differing = Randomization.of(randomize, played, nominal)
        return cls(played, nominal, actions, int(frame_skip), differing, pay, limits)

    def episode(self, random: np.random.Generator) -> tuple[Experiment, dict[str, Any]]:
        """The experiment of the next episode, and what was drawn for it by name."""
        values = self.randomization.draw(random)
        return (changed(self.experiment, values) if values else self.experiment), values

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the numbers of an observation."""
        return (*NAMES, *(f"previous_{name}" for name in self.actions.names))

    @property
    def observation_units(self) -> tuple[str, ...]:
        """Their units."""
        return (*UNITS, *("" for _ in self.actions.names))


def counted(name: str, given: Any) -> None:
    """Refuses what is no number of things.

    Raises:
        ParameterError: it is not a whole number, or less than 1.
    """
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or given < 1:
        raise ParameterError(f"{name} = {given!r}: must be a whole number, 1 or more")


def _experiment(given: Any) -> Experiment:
    if given is None:
        return Experiment()
    if isinstance(given, Experiment):
        return given
    if isinstance(given, Mapping):
        return Experiment(**with_changes({}, given))
    if isinstance(given, str | PathLike):
        return Experiment.from_toml(Path(given))
    raise ParameterError(f"experiment = {given!r}: an Experiment, a table of its values, or a TOML file is needed")


def _table(name: str, kind: type[Kind], given: Any) -> Kind:
    if isinstance(given, kind):
        return given
    if given is not None and not isinstance(given, Mapping):
        raise ParameterError(f"{name} = {given!r}: a table is needed, of {', '.join(kind.model_fields)}")
    try:
        return kind(**(given or {}))
    except ParameterError as error:
        raise ParameterError(f"{name}: {error}") from None
