"""What runs that follow one another on one thread share: made once, as long as it is asked for the same.

A run without a workbench of its own gets a new one, so that every run goes through the same functions, and comes to the
same bits, whatever came before it.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, NamedTuple, TypeVar

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.control.contract import Law
from spherical_wrist.plant import Perturbation
from spherical_wrist.simulation.engine import Engine, compiled_engine
from spherical_wrist.simulation.loop import LOG
from spherical_wrist.simulation.nominal import Motion, NominalModel
from spherical_wrist.simulation.physics import physics_model
from spherical_wrist.simulation.plant_model import PlantModel
from spherical_wrist.simulation.timing import Timing
from spherical_wrist.wrist import Wrist, WristFile

Array = npt.NDArray[np.float64]
Made = TypeVar("Made")

KEPT = 16
"""Models, laws and values of each kind that are kept."""

SEATS = 16
"""Runs that may be prepared at a time, before they are run one after the other."""


class Machine(NamedTuple):
    """Plant and nominal model, ready for the loop.

    Attributes:
        model: the plant as it is stepped.
        data: its data, as made.
        nominal: what the controller evaluates.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    nominal: NominalModel


def machine_of(plant: Wrist, nominal: Wrist, timing: Timing, engine: Engine) -> Machine:
    """A machine of two wrists, with models of its own.

    Raises:
        ModelError: MuJoCo cannot step the plant.
    """
    model = physics_model(plant, timing.physics_period)
    return Machine(model, mujoco.MjData(model), NominalModel(nominal, timing, engine))


class PreparedLaw(NamedTuple):
    """A law as the loop takes it.

    Attributes:
        law: the law.
        packed: its parameters.
        step: its step.
    """

    law: Law
    packed: Array
    step: Callable[..., None]


class Memory:
    """Keeps the last few things that were made, by what they were made from."""

    def __init__(self, size: int = KEPT) -> None:
        self._size = size
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """What was made for an equal key, or else what ``make`` returns now."""
        try:
            self._kept.move_to_end(key)
        except KeyError:
            self._kept[key] = make()
            if len(self._kept) > self._size:
                self._kept.popitem(last=False)
        except TypeError:  # something in the key has no hash
            return make()
        made: Made = self._kept[key]
        return made


class Workbench:
    """Models, laws and sampled motions for runs on one thread.

    Args:
        engine: how to run; compiled where none is given.
        arrays: sampled motions and disturbances that are kept, of up to 0.7 MB each.
    """

    def __init__(self, engine: Engine | None = None, arrays: int = 4) -> None:
        self.engine = engine or compiled_engine()
        self.tried: set[type[Law]] = set()
        self._wrists, self._nominals, self._laws, self._plants = Memory(), Memory(), Memory(), Memory(KEPT * SEATS)
        self._values, self._arrays = Memory(), Memory(arrays)
        self._log = np.empty(0, LOG)

    def wrist(self, file: WristFile) -> Wrist:
        """The wrist of an MJCF file.

        Raises:
            ModelError: the file is not a wrist.
        """
        return self._wrists.get(file, file.load)

    def machine(self, file: WristFile, change: Perturbation, timing: Timing, seat: int = 0) -> Machine:
        """Plant and nominal model of the wrist of an MJCF file, valid until the next ones are asked for on that seat.

        Raises:
            ModelError: MuJoCo refuses the plant, or cannot step it.
        """
        step, wrist = timing.physics_period, self.wrist(file)
        first = self._plants.get((file, step), lambda: PlantModel(wrist, step))
        plant = self._plants.get((file, step, seat), first.another) if seat else first
        plant.perturb(change)
        nominal = self._nominals.get((file, step), lambda: NominalModel(wrist, timing, self.engine))
        return Machine(plant.model, plant.data, nominal)

    def law(self, law: Law) -> PreparedLaw:
        """A law, packed and compiled.

        Raises:
            LawError: it cannot be compiled.
        """
        return self._laws.get(id(law), lambda: PreparedLaw(law, law.packed(), self.engine.step(law)))

    def log(self, count: int) -> npt.NDArray[Any]:
        """Room for the log of ``count`` control periods; the next that is asked for may be the same."""
        if len(self._log) < count:
            self._log = np.empty(count, LOG)
        return self._log[:count]

    def value(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """A value by what it depends on."""
        return self._values.get(key, make)

    def sampled(self, key: Hashable, function: Callable[[Array], Made]) -> Callable[[Array], Made]:
        """A function of time that remembers what it gave; ``key`` is what it depends on."""
        return lambda time: self._arrays.get((key, time.tobytes()), lambda: function(time))


class Sampled:
    """A reference whose motion is remembered where it was asked for.

    Args:
        reference: the reference, with everything random in it drawn.
        bench: where it is remembered.
    """

    def __init__(self, reference: Motion, bench: Workbench) -> None:
        self.motion = bench.sampled(("motion", reference), reference.motion)
