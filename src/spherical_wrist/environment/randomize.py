"""Randomization of episodes, drawn from the environment's random generator."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from spherical_wrist.campaign.distribution import Distribution, distribution
from spherical_wrist.campaign.episode import AXES, changed
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.wrist import Wrist

MAX_OPTIONS = 64
"""Largest number of options of a choice that are checked in advance."""

FIXED = ("law", "model", "control_period", "physics_period")
"""Parameters that cannot be randomized."""


class Randomization(NamedTuple):
    """Distributions of an experiment's parameters, by dotted name."""

    distributions: Mapping[str, Distribution]

    @classmethod
    def of(cls, given: Mapping[str, Any] | None, base: Experiment, nominal: Wrist) -> Self:
        """Read distributions.

        Args:
            given: distributions by dotted name, such as ``mass_scale``, ``disturbance.level``, ``com_shift.x``, or
                ``com_shift.*`` for each axis independently. A pair ``(low, high)`` is a uniform distribution; others
                are written as in a campaign file, such as ``{"loguniform": [0.01, 0.1]}`` or
                ``{"choice": ["hold", "lissajous"]}``. A pair for ``seed`` gives integers from ``low`` to ``high``.
            base: experiment that is changed.
            nominal: nominal wrist of the experiment.

        Raises:
            ParameterError: ``given`` is not a table, a name or a distribution is not valid, or the experiment is not
                valid at an end of a distribution.
        """
        if given is not None and not isinstance(given, Mapping):
            raise ParameterError(
                f"randomize = {given!r}: a table of ranges by name is needed: {{'payload': (0, 0.02)}}"
            )
        distributions: dict[str, Distribution] = {}
        for name, form in (given or {}).items():
            if name.partition(".")[0] in FIXED:
                raise ParameterError(f"randomize {name}: {', '.join(FIXED)} are the same in every episode")
            for each in [name[:-1] + axis for axis in AXES] if name.endswith(".*") else [name]:
                distributions[each] = _checked(each, form, base, nominal)
        return cls(distributions)

    def draw(self, random: np.random.Generator) -> dict[str, Any]:
        """Draw the values of one episode, by dotted name."""
        return {name: each.value(float(random.random())) for name, each in self.distributions.items()}


def _checked(name: str, form: Any, base: Experiment, nominal: Wrist) -> Distribution:
    try:
        drawn_from = distribution(name, _named(name, form))
    except ParameterError as error:
        raise ParameterError(str(error).replace("vary ", "randomize ", 1)) from None
    if name == "disturbance.level" and base.disturbance.amplitude is not None:
        raise ParameterError("randomize disturbance.level: it has no effect beside disturbance.amplitude")
    # an unbounded distribution is checked at values that 1 in 10 000 episodes exceeds
    ends = [drawn_from.value(u) for u in (0.0001, 0.5, 0.9999)]
    for value in (*(drawn_from.options or ())[:MAX_OPTIONS], *ends):
        try:
            changed(base, {name: value}).timing(nominal)
        except WristError as error:
            raise ParameterError(f"randomize {name}: {error}") from None
    return drawn_from


def _named(name: str, form: Any) -> Any:
    """Return the distribution of a pair; return anything else unchanged."""
    pair = isinstance(form, list | tuple) and len(form) == 2
    if not pair or not all(isinstance(end, int | float) and not isinstance(end, bool) for end in form):
        return form
    if name == "seed":
        return {"integers": list(form)}
    return {"uniform": [float(end) for end in form]}
