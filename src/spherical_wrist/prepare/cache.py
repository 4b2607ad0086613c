"""Cache of models, references and compiled laws, reused by consecutive runs of one thread.

Every run uses a cache; its result does not depend on earlier runs. ``simulate`` uses the cache of its thread.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, Self, TypeVar

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.control.contract import Law
from spherical_wrist.experiment.perturbation import Perturbation
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.engine import Engine, compiled_engine
from spherical_wrist.loop.loop import LOG
from spherical_wrist.prepare.inputs import CachedMotion, HasMotion
from spherical_wrist.prepare.nominal import NominalModel
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.prepare.plant import PlantModel
from spherical_wrist.stages import stage
from spherical_wrist.wrist import Wrist, WristFile, default_model, model_files

Value = TypeVar("Value")

CACHE_SIZE = 16
"""Number of models, of laws and of values that a cache keeps."""

SLOTS = 16
"""Number of runs that can be prepared together, each with its own plant."""


class Models(NamedTuple):
    """Plant and nominal model, ready for the loop.

    Attributes:
        wrist: nominal wrist; the plant has the same motors and tool.
        plant: model of the plant.
        data: data of the plant, at its initial state.
        nominal: nominal model, which the controller evaluates.
    """

    wrist: Wrist
    plant: mujoco.MjModel
    data: mujoco.MjData
    nominal: NominalModel

    @classmethod
    def of(cls, plant: Wrist, nominal: Wrist, timing: Timing, engine: Engine) -> Self:
        """Create the models of two wrists.

        Raises:
            ModelError: MuJoCo cannot step the plant.
        """
        model = physics_model(plant, timing.physics_period)
        return cls(plant, model, mujoco.MjData(model), NominalModel(nominal, timing, engine))


class PreparedLaw(NamedTuple):
    """Law in the form that the loop takes.

    Attributes:
        law: the law.
        packed: packed parameters.
        step: compiled or interpreted step.
    """

    law: Law
    packed: Array
    step: Callable[..., None]


class LRU:
    """Cache of the most recently used values, by key."""

    def __init__(self, size: int = CACHE_SIZE) -> None:
        self._size = size
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return the value of a key; create it with ``make`` if the cache has none."""
        try:
            self._kept.move_to_end(key)
        except KeyError:
            self._kept[key] = make()
            if len(self._kept) > self._size:
                self._kept.popitem(last=False)
        except TypeError:  # something in the key has no hash
            return make()
        made: Value = self._kept[key]
        return made


class RunCache:
    """Models, laws and sampled motions for runs on one thread.

    Args:
        engine: compiled or interpreted; compiled by default.
        arrays: number of sampled motions and disturbances that are kept, up to 0.7 MB each.

    Attributes:
        engine: compiled or interpreted.
        checked_laws: classes of laws that have passed one interpreted step.
    """

    def __init__(self, engine: Engine | None = None, arrays: int = 4) -> None:
        self.engine = engine or compiled_engine()
        self.checked_laws: set[type[Law]] = set()
        self._wrists, self._nominals, self._laws, self._plants = LRU(), LRU(), LRU(), LRU(CACHE_SIZE * SLOTS)
        self._values, self._arrays = LRU(), LRU(arrays)
        self._log = np.empty(0, LOG)

    def wrist(self, file: WristFile) -> Wrist:
        """Return the wrist of an MJCF file.

        Raises:
            ModelError: the file is not a wrist.
        """
        return self._wrists.get(file, lambda: _loaded(file))

    def models(self, file: WristFile, change: Perturbation, timing: Timing, slot: int = 0) -> Models:
        """Return the models of an MJCF file, valid until the next call for the same slot.

        Raises:
            ModelError: MuJoCo refuses the plant, or cannot step it.
        """
        step, wrist = timing.physics_period, self.wrist(file)
        first = self._plants.get((file, step), lambda: PlantModel(wrist, step))
        plant = self._plants.get((file, step, slot), first.copy) if slot else first
        plant.perturb(change)
        nominal = self._nominals.get((file, step), lambda: NominalModel(wrist, timing, self.engine))
        return Models(wrist, plant.model, plant.data, nominal)

    def law(self, law: Law, period: float) -> PreparedLaw:
        """Return a law, packed for a control period [s], and compiled.

        Raises:
            LawError: it cannot be compiled.
        """
        key = id(law), period
        return self._laws.get(key, lambda: PreparedLaw(law, law.packed(period), self.engine.step(law)))

    def log(self, count: int) -> npt.NDArray[Any]:
        """Return memory for the log of ``count`` control periods; the next call may return the same memory."""
        if len(self._log) < count:
            self._log = np.empty(count, LOG)
        return self._log[:count]

    def value(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return the value of a key, which holds all that the value depends on."""
        return self._values.get(key, make)

    def sampled(self, key: Hashable, function: Callable[[Array], Value]) -> Callable[[Array], Value]:
        """Return a cached function of time; ``key`` holds all that its values depend on, except the time."""
        return lambda time: self._arrays.get((key, time.tobytes()), lambda: function(time))

    def motion(self, reference: HasMotion, state: Hashable = None) -> CachedMotion:
        """Return a reference whose samples are cached. Its random parameters must be drawn already.

        Args:
            reference: the reference.
            state: all that its motion depends on besides its parameters.
        """
        return CachedMotion(self.sampled(("motion", reference, state), reference.motion))


_THREAD = threading.local()

CACHES_PER_THREAD = 4
"""Number of caches that a thread keeps between calls of ``simulate``, one for each MJCF file."""


def thread_cache(file: WristFile) -> RunCache:
    """Return the cache of this thread for the present contents of an MJCF file.

    Raises:
        ModelError: the files cannot be read.
    """
    if not hasattr(_THREAD, "caches"):
        _THREAD.caches = LRU(CACHES_PER_THREAD)
    contents = tuple(model_files(file.model or default_model()).values())
    found: RunCache = _THREAD.caches.get((file, contents), RunCache)
    return found


def _loaded(file: WristFile) -> Wrist:
    with stage(f"model {file.model or 'of the package'} read"):
        return file.load()


class CachePool:
    """Pool of caches, each used by one thread at a time.

    Args:
        arrays: see :class:`RunCache`.
    """

    def __init__(self, arrays: int = 4) -> None:
        self._arrays = arrays
        self._idle: list[RunCache] = []

    @contextmanager
    def borrowed(self) -> Iterator[RunCache]:
        """Lend a cache to this thread."""
        try:
            cache = self._idle.pop()
        except IndexError:
            cache = RunCache(arrays=self._arrays)
        try:
            yield cache
        finally:
            self._idle.append(cache)
