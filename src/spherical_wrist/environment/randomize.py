"""What differs from episode to episode, drawn from the environment's own generator."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from spherical_wrist.campaign.distribution import Distribution, distribution
from spherical_wrist.campaign.episode import AXES, changed
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.wrist import Wrist

MOST_OPTIONS = 64
"""Values of a choice that are checked beforehand."""

FIXED = ("law", "model", "control_period", "physics_period")
"""Parameters that all episodes of an environment share."""


class Randomization(NamedTuple):
    """Distributions by the dotted names of an experiment's parameters."""

    distributions: Mapping[str, Distribution]

    @classmethod
    def of(cls, given: Mapping[str, Any] | None, base: Experiment, nominal: Wrist) -> Self:
        """What is given as ranges.

        Args:
            given: by dotted name, such as ``mass_scale``, ``disturbance.level``, ``com_shift.x``, or for each axis on
                its own ``com_shift.*``: a pair ``(low, high)``, uniform between the two, or a distribution as in a
                campaign file, such as ``{"loguniform": [0.01, 0.1]}`` or ``{"choice": ["hold", "lissajous"]}``. Whole
                numbers such as ``seed`` are drawn from ``low`` to ``high``.
            base: the experiment that is changed.
            nominal: its nominal wrist.

        Raises:
            ParameterError: it is not a table, a name or a distribution is not valid, or the experiment is not at one
                of its ends.
        """
        if given is not None and not isinstance(given, Mapping):
            raise ParameterError(
                f"randomize = {given!r}: a table of ranges by name is needed: {{'payload': (0, 0.02)}}"
            )
        found: dict[str, Distribution] = {}
        for name, form in (given or {}).items():
            if name.partition(".")[0] in FIXED:
                raise ParameterError(f"randomize {name}: {', '.join(FIXED)} are the same in every episode")
            for each in [name[:-1] + axis for axis in AXES] if name.endswith(".*") else [name]:
                found[each] = _checked(each, form, base, nominal)
        return cls(found)

    def draw(self, random: np.random.Generator) -> dict[str, Any]:
        """The values of one episode by name."""
        return {name: each.value(float(random.random())) for name, each in self.distributions.items()}


def _checked(name: str, form: Any, base: Experiment, nominal: Wrist) -> Distribution:
    try:
        found = distribution(name, _named(name, form))
    except ParameterError as error:
        raise ParameterError(str(error).replace("vary ", "randomize ", 1)) from None
    if name == "disturbance.level" and base.disturbance.amplitude is not None:
        raise ParameterError("randomize disturbance.level: it has no effect beside disturbance.amplitude")
    # of a distribution without ends, what 1 in 10 000 episodes exceeds
    ends = [found.value(u) for u in (0.0001, 0.5, 0.9999)]
    for value in (*(found.options or ())[:MOST_OPTIONS], *ends):
        try:
            changed(base, {name: value}).timing(nominal)
        except WristError as error:
            raise ParameterError(f"randomize {name}: {error}") from None
    return found


def _named(name: str, form: Any) -> Any:
    """The distribution that a pair stands for."""
    pair = isinstance(form, list | tuple) and len(form) == 2
    if not pair or not all(isinstance(end, int | float) and not isinstance(end, bool) for end in form):
        return form
    if name == "seed":
        return {"integers": list(form)}
    return {"uniform": [float(end) for end in form]}
