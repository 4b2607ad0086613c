"""Task: checked arguments of an environment, the same for one environment and for a vector environment."""

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

from spherical_wrist.campaign.episode import changed
from spherical_wrist.environment.action import Actions
from spherical_wrist.environment.observation import NAMES, UNITS
from spherical_wrist.environment.randomize import Randomization
from spherical_wrist.environment.reward import Limits, Reward
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.parameters import Parameters
from spherical_wrist.wrist import Wrist

Kind = TypeVar("Kind", bound=Parameters)


class Task(NamedTuple):
    """Settings that all episodes of an environment share.

    Attributes:
        experiment: experiment before randomization, with the law that the loop runs.
        nominal: nominal wrist.
        actions: mapping from actions to parameters of that law.
        frame_skip: number of control periods for which an action is held.
        randomization: distributions of the parameters that differ between episodes.
        reward: weights and scales of the reward.
        limits: thresholds that terminate an episode early.
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
        """Check the arguments of an environment; see :class:`spherical_wrist.environment.track.TrackEnv`.

        Raises:
            WristError: an argument is not valid; in one line.
        """
        given = _experiment(experiment)
        nominal = given.nominal()
        given.timing(nominal)
        check_count("frame_skip", frame_skip)
        actions = Actions.of(action, given.law, nominal, gains, gain_factor)
        weights, limits = _table("reward", Reward, reward), _table("terminate_beyond", Limits, terminate_beyond)
        if not weights.tip + weights.effort + weights.chattering > 0.0:
            raise ParameterError("reward: one of the weights tip, effort and chattering must be positive")
        base = given.replaced(law=actions.law)
        randomization = Randomization.of(randomize, base, nominal)
        return cls(base, nominal, actions, int(frame_skip), randomization, weights, limits)

    def episode(self, random: np.random.Generator) -> tuple[Experiment, dict[str, Any]]:
        """Draw the experiment of the next episode. Return it with the drawn values by dotted name."""
        values = self.randomization.draw(random)
        return (changed(self.experiment, values) if values else self.experiment), values

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the numbers of an observation."""
        return (*NAMES, *(f"previous_{name}" for name in self.actions.names))

    @property
    def observation_units(self) -> tuple[str, ...]:
        """Units of the numbers of an observation."""
        return (*UNITS, *("" for _ in self.actions.names))


def refuse_others(others: Mapping[str, Any], known: Iterable[str]) -> None:
    """Refuse arguments that an environment does not have, and say where they belong.

    Args:
        others: the arguments.
        known: names of those that it has.

    Raises:
        UnknownNameError: a name is unknown.
        ParameterError: a name is one of an experiment, of a reward, or of a limit.
    """
    tables = {
        "experiment": {*Experiment.model_fields, "hardware"},
        "reward": set(Reward.model_fields),
        "terminate_beyond": set(Limits.model_fields),
    }
    for name, value in others.items():
        if name == "num_envs":
            raise ParameterError(f"num_envs = {value!r}: several wrists are made by gymnasium.make_vec(...)")
        table = next((table for table, names in tables.items() if name.partition(".")[0] in names), None)
        if table is None:
            raise UnknownNameError("argument", name, set(known) - {"self", "others"})
        if table == "experiment" and isinstance(value, tuple | list) and len(value) == 2:
            table = "randomize"
        same = {name: value}
        if table != "randomize":
            same = {other: each for other, each in others.items() if other.partition(".")[0] in tables[table]}
        advice = f"; the seed of an episode is given to reset(seed={value!r})" if name == "seed" else ""
        raise ParameterError(f"{name} = {value!r} is no argument of an environment: write {table}={same!r}{advice}")


def check_count(name: str, given: Any) -> None:
    """Check that an argument is a positive integer.

    Raises:
        ParameterError: it is not an integer, or less than 1.
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
