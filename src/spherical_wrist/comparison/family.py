"""Families of perturbed wrists: all combinations of given values, or a seeded random sample of given ranges."""

from abc import abstractmethod
from collections.abc import Iterator
from itertools import product
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field

from spherical_wrist.disturbance import Disturbance
from spherical_wrist.errors import UnknownNameError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.parameters import Components, NonNegative, Parameters, Positive, quantity


def _ascending(given: tuple[float, float]) -> tuple[float, float]:
    if given[0] > given[1]:
        raise ValueError("the lower end of the range comes first")
    return given


def _known(shape: str) -> str:
    if shape not in Disturbance.members:
        raise UnknownNameError("disturbance", shape, Disturbance.members)
    return shape


Shape = Annotated[str, AfterValidator(_known)]
Some = Field(min_length=1)
Range = Annotated[tuple[NonNegative, NonNegative], AfterValidator(_ascending)]
PositiveRange = Annotated[tuple[Positive, Positive], AfterValidator(_ascending)]


class WristFamily(Parameters):
    """Family of plants that differ from the nominal wrist."""

    def experiments(self, base: Experiment) -> list[Experiment]:
        """Return the experiments of the family: ``base`` with the varied parameters. Equal experiments appear once."""
        return list(dict.fromkeys(base.replaced(**changes) for changes in self._changes(base)))

    @abstractmethod
    def _changes(self, base: Experiment) -> Iterator[dict[str, Any]]:
        """Yield the changes of an experiment for each wrist of the family."""


class WristGrid(WristFamily):
    """All combinations of given values; by default 18 wrists.

    The defaults are mass scales of 0.75, 1 and 1.25; centres of mass at their nominal position or shifted by 2 mm; and
    no disturbance, or 25 % of the peak nominal torque, constant or sinusoidal.
    """

    mass_scale: Annotated[tuple[Positive, ...], Some] = quantity((0.75, 1.0, 1.25), "", "scales of mass and inertia")
    com_shift: Annotated[tuple[Components, ...], Some] = quantity(
        ((0.0, 0.0, 0.0), (0.002, 0.0, 0.0)), "m", "shifts of the centres of mass"
    )
    payload: Annotated[tuple[NonNegative, ...], Some] = quantity((0.0,), "kg", "point masses at the tool tip")
    disturbance: Annotated[tuple[NonNegative, ...], Some] = quantity((0.0, 0.25), "", "levels of the disturbance")
    shape: Annotated[tuple[Shape, ...], Some] = quantity(("constant", "sinusoid"), "", "shapes of the disturbance")

    def _changes(self, base: Experiment) -> Iterator[dict[str, Any]]:
        values = product(self.mass_scale, self.com_shift, self.payload, self.disturbance, self.shape)
        for mass_scale, com_shift, payload, level, shape in values:
            yield {
                "mass_scale": mass_scale,
                "com_shift": com_shift,
                "payload": payload,
                # at level 0 all shapes are the same
                "disturbance": _disturbance(base, shape if level else self.shape[0], level),
            }


class RandomWrists(WristFamily):
    """Random sample, uniform and independent in every range; the same sample for the same seed.

    Every wrist also has its own seed for the random parts of a run: noise, lost samples, random references.
    """

    samples: Annotated[int, Field(ge=1)] = quantity(20, "", "number of wrists")
    seed: Annotated[int, Field(ge=0)] = quantity(0, "", "seed of the sample")
    mass_scale: PositiveRange = quantity((0.75, 1.25), "", "scale of mass and inertia")
    com_shift: NonNegative = quantity(0.002, "m", "largest shift of the centres of mass; uniform in a ball")
    payload: Range = quantity((0.0, 0.01), "kg", "point mass at the tool tip")
    disturbance: Range = quantity((0.0, 0.25), "", "level of the disturbance")
    shape: Annotated[tuple[Shape, ...], Some] = quantity(("constant", "sinusoid"), "", "shapes of the disturbance")

    def _changes(self, base: Experiment) -> Iterator[dict[str, Any]]:
        random = np.random.default_rng(self.seed)
        for _ in range(self.samples):
            direction = random.normal(size=3)
            shift = self.com_shift * random.random() ** (1.0 / 3.0) * direction / np.linalg.norm(direction)
            level, shape = _rounded(random.uniform(*self.disturbance)), self.shape[random.integers(len(self.shape))]
            yield {
                "mass_scale": _rounded(random.uniform(*self.mass_scale)),
                "com_shift": tuple(_rounded(component) for component in shift),
                "payload": _rounded(random.uniform(*self.payload)),
                "disturbance": _disturbance(base, shape, level),
                "seed": int(random.integers(2**31)),
            }


def _disturbance(base: Experiment, shape: str, level: float) -> Disturbance:
    """Return a disturbance of a shape and level; its other parameters are those of ``base`` if that has this shape."""
    if base.disturbance.name == shape:
        return base.disturbance.replaced(level=level, amplitude=None)
    perturbing: Disturbance = Disturbance.resolve({"name": shape, "level": level}, default=shape)
    return perturbing


def _rounded(value: float) -> float:
    """Round to four digits, which keeps the replay command of a sample short."""
    return float(f"{value:.4g}")
