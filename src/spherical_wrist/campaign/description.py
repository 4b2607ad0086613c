"""Description of a campaign, validated and frozen.

A campaign file is TOML::

    laws = ["pd", "fuzzy_sliding_computed_torque", { name = "computed_torque", Kp = 10000, Kv = 200 }]
    samples = 1000
    design = "sobol"                # or grid, latin_hypercube, random
    seed = 1                        # of everything random
    hardware = "realistic"          # as with wrist run; may be left out

    [experiment]                    # base of every episode, as in an experiment file
    duration = 4.0
    disturbance = { name = "noise", level = 0.2 }

    [vary]                          # parameters by dotted name, each with a distribution
    mass_scale = { uniform = [0.5, 1.5] }
    payload = [0.0, 0.01, 0.02]                               # a list is a choice
    "disturbance.level" = { truncated_normal = [0.2, 0.1, 0.0, 0.5] }
    "com_shift.x" = { normal = [0.0, 0.001] }                 # one axis of three: x, y or z
    "reference.amplitude" = { linear = [0.1, 0.5, 5] }        # one number for all three axes
    "initial_error.*" = { uniform = [-0.05, 0.05] }           # each axis on its own

Distributions are ``uniform``, ``loguniform``, ``normal``, ``truncated_normal``, ``integers``, ``choice``, ``constant``,
and ``linear`` and ``logarithmic``, so many values at equal distances or ratios. In a grid every combination is an
episode, so that there, values must be countable and ``samples`` is not needed.

Every law sees the same samples with the same seeds, so that laws are compared pair by pair; a parameter ``law.K`` is
varied in all of them and must be one of each. A law is called by its name with the parameters given beside it, or in a
table ``[laws]`` by any label: ``stiff = { name = "computed_torque", Kp = 10000, Kv = 200 }``. An episode's seed follows
from the campaign's and its sample, unless ``seed`` is varied itself: ``seed = { integers = [0, 9] }`` makes ten
repetitions of every point of a grid.
"""

import json
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from spherical_wrist.campaign.design import SOBOL_BITS, DesignName, draw, episode_seed, grid_size
from spherical_wrist.campaign.distribution import Distribution, distribution
from spherical_wrist.campaign.episode import AXES, Episode, changed
from spherical_wrist.campaign.portable import without_folders
from spherical_wrist.consent import is_code
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.experiment.description import Experiment, read_toml, with_changes
from spherical_wrist.parameters import Member, Parameters, quantity

MOST_EPISODES = 10**12


def _labelled(given: Any) -> Any:
    """Return laws by label, from a list of names and tables or from a table."""
    if isinstance(given, list | tuple):
        labelled: dict[str, Any] = {}
        for law in given:
            label = _label(law)
            if label in labelled:
                raise ParameterError(f"laws: {label!r} is there twice; in a table [laws] each can have a label")
            labelled[label] = law
        given = labelled
    if given is not None and (not isinstance(given, Mapping) or not given):
        raise ParameterError(f"laws = {given!r}: a list of laws, or a table of laws by label, is needed")
    return given


def _label(law: Any) -> str:
    if not isinstance(law, Mapping):
        return str(without_folders(str(law), 1))
    parameters = (f"{name}={value}" for name, value in law.items() if name != "name")
    return " ".join([str(without_folders(str(law.get("name", "")), 1)), *parameters]).strip()


class Campaign(Parameters):
    """A design over one experiment: laws × samples.

    Raises:
        ParameterError: a value is not valid; in one line. The values that will be drawn are checked by
            :mod:`spherical_wrist.campaign.validation`.
    """

    experiment: dict[str, Any] = quantity({}, "", "base of every episode: values of an experiment")
    hardware: str | None = quantity(None, "", "preset of sensors and motors that the experiment starts from")
    laws: Annotated[dict[str, Any] | None, BeforeValidator(_labelled)] = quantity(None, "", "laws to compare, by label")
    samples: Annotated[int, Field(gt=0)] | None = quantity(None, "", "number of samples; of a grid, all its points")
    design: DesignName = quantity("sobol", "", "of the samples")
    seed: Annotated[int, Field(ge=0)] = quantity(0, "", "of everything random")
    vary: dict[str, Any] = quantity({}, "", "distributions of the varied parameters, by dotted name")
    batch: Annotated[int, Field(gt=0)] | None = quantity(
        None, "", "episodes that are run and stored together; by default about a second of work"
    )

    @classmethod
    def from_toml(cls, path: Path | str, changes: Mapping[str, Any] | None = None) -> Self:
        """Read a campaign file.

        Args:
            path: the file.
            changes: values of the experiment by dotted name, and of ``hardware`` and ``seed``, that replace those of
                the file.

        Raises:
            ParameterError: the file cannot be read, is not TOML, or does not describe a campaign.
        """
        tables, own = read_toml(Path(path)), dict(changes or {})
        tables |= {name: own.pop(name) for name in ("hardware", "seed") if name in own}
        if own and isinstance(tables.get("experiment", {}), Mapping):
            tables["experiment"] = with_changes(tables.get("experiment", {}), own)
        return cls(**tables)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.laws is not None and "law" in self.experiment:
            raise ParameterError("there are laws and experiment.law: give one of them")
        for name in self.distributions:
            if name in ("law", "law.name"):
                raise ParameterError(f"vary {name}: give laws = [...] instead, so that they all see the same samples")
        for base in self.bases.values():
            _check_names(base, self.distributions)
        if self.design == "grid":
            points = grid_size(self.distributions)
            if self.samples not in (None, points):
                raise ParameterError(f"samples = {self.samples}: the grid has {points} points; leave samples out")
        elif self.samples is None:
            raise ParameterError(f'samples: a design = "{self.design}" needs their number, such as samples = 1000')
        if self.design == "sobol" and self.sample_count > 2**SOBOL_BITS:
            raise ParameterError(f"samples = {self.samples}: a Sobol sequence has at most 2^{SOBOL_BITS} points")
        if self.size > MOST_EPISODES:
            raise ParameterError(f"{self.size} episodes: {MOST_EPISODES} are the most")
        return self

    @cached_property
    def distributions(self) -> dict[str, Distribution]:
        """Distributions of the varied parameters, by dotted name; ``*`` for every axis is spelt out.

        Raises:
            ParameterError: a parameter is varied twice, or something is not a distribution.
        """
        found = {}
        for name, given in self.vary.items():
            names = [name[:-1] + axis for axis in AXES] if name.endswith(".*") else [name]
            for each in names:
                if each in found:
                    raise ParameterError(f"vary {name}: {each} is varied twice")
                found[each] = distribution(each, given)
        return found

    @cached_property
    def bases(self) -> dict[str, Experiment]:
        """The experiment before its parameters are varied, under each law by its label.

        Raises:
            ParameterError: the experiment is not valid.
        """
        start: dict[str, Any] = {} if self.hardware is None else {"hardware": self.hardware}
        try:
            first = Experiment(**start | self.experiment)
        except WristError as error:
            raise ParameterError(f"experiment: {error}") from None
        if self.laws is None:
            return {first.law.name: first}
        return {label: first.replaced(law=law) for label, law in self.laws.items()}

    @cached_property
    def sample_count(self) -> int:
        """Number of samples."""
        return grid_size(self.distributions) if self.design == "grid" else int(self.samples or 0)

    @property
    def size(self) -> int:
        """Number of episodes."""
        return self.sample_count * len(self.bases)

    def episodes(self, first: int, last: int) -> Iterator[Episode]:
        """Yield the episodes with the ids ``first`` up to but not including ``last``."""
        laws = list(self.bases.items())
        begin, end = first // len(laws), -(-last // len(laws))
        samples = draw(self.design, self.distributions, self.sample_count, self.seed, begin, end)
        for sample, values in enumerate(samples, begin):
            seed = values.get("seed", episode_seed(self.seed, sample))
            for position, (label, base) in enumerate(laws):
                number = sample * len(laws) + position
                if first <= number < last:
                    yield Episode(number, sample, label, seed, values, base)

    def resolved(self) -> "Campaign":
        """Return the campaign with every default and path spelt out: it means the same in every folder."""
        dumped = {label: base.model_dump(mode="json") for label, base in self.bases.items()}
        laws = {label: dump.pop("law") for label, dump in dumped.items()}
        first = next(iter(self.bases.values()))
        vary = {name: _with_whole_paths(first, name, given, self.distributions) for name, given in self.vary.items()}
        rest: dict[str, Any] = {name: getattr(self, name) for name in ("samples", "design", "seed", "batch")}
        return type(self)(experiment=next(iter(dumped.values())), laws=laws, vary=vary, **rest)

    def to_json(self) -> str:
        """Return the campaign as one line of JSON for :meth:`from_json`."""
        return json.dumps(self.model_dump(mode="json"), ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Create a campaign from the JSON of :meth:`to_json`."""
        return cls(**json.loads(text))


def _check_names(base: Experiment, vary: Mapping[str, Distribution]) -> None:
    """Refuse names that are no parameters, by changing each to a value of its distribution."""
    for name, found in vary.items():
        try:
            changed(base, {name: found.value(0.5)})
        except WristError as error:
            raise ParameterError(f"vary {name}: {error}") from None


def _with_whole_paths(base: Experiment, name: str, given: Any, vary: Mapping[str, Distribution]) -> Any:
    """Return the distribution of a parameter as given, with files among its values as absolute paths."""
    options = vary[name].options if name in vary and vary[name].kind in ("text", "table") else None
    whole = [_with_whole_path(base, name, option) for option in options or ()]
    return {"choice": whole} if options and whole != list(options) else given


def _with_whole_path(base: Experiment, name: str, option: Any) -> Any:
    key, _, parameter = name.partition(".")
    part = getattr(changed(base, {name: option}), key)
    if parameter:
        value = getattr(part, parameter, None)
        if parameter == "name" and is_code(option):
            return type(part).address
        return str(value) if isinstance(value, Path) else option
    if isinstance(part, Path):
        return str(part)
    files = {field: str(value) for field, value in part if isinstance(value, Path)} if isinstance(part, Member) else {}
    if not files and not is_code(getattr(type(part), "address", "")):
        return option
    return {**(option if isinstance(option, Mapping) else {}), "name": type(part).address, **files}
