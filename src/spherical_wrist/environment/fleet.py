"""Episodes side by side: each with a plant of its own, all of them played on in one call of compiled code."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.environment.episode import Episode
from spherical_wrist.environment.observation import SEEN
from spherical_wrist.environment.play import RESULT, ROW, play
from spherical_wrist.environment.task import Task, counted
from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.libmujoco import warnings_kept_in_data
from spherical_wrist.simulation.bulk import PLAYING
from spherical_wrist.simulation.compiler import compiled
from spherical_wrist.simulation.nominal import NominalModel
from spherical_wrist.simulation.plant_model import PlantModel
from spherical_wrist.simulation.workbench import Machine, Workbench

Array = npt.NDArray[np.float64]

TRUTH = ("error", "rate_error", "tip_error_mm", "torque")
"""What of a result is told in an info."""


class Fleet:
    """Seats for episodes of one task.

    Args:
        task: what they have in common.
        seats: how many.
        threads: that share them.

    Attributes:
        results: what came of the last call, RESULT (seats,).
        observations: what is seen now, (seats, numbers of an observation).
        episodes: the last episode of each seat, by seat.
        infos: of seats whose episode ended in the last call, what came of it.

    Raises:
        WristError: the law cannot be compiled, or MuJoCo cannot step the wrist.
    """

    def __init__(self, task: Task, seats: int, threads: int = 1) -> None:
        counted("num_envs", seats)
        counted("threads", threads)
        self._task, self._bench = task, Workbench()
        self._play = compiled(play, ROW, RESULT, np.float64)
        timing, threads = task.experiment.timing(task.nominal), min(threads, seats)
        plant = PlantModel(task.nominal, timing.physics_period)
        self._plants = [plant, *(plant.another() for _ in range(seats - 1))]
        # the nominal model is working memory: each thread has its own, for all of its seats
        nominals = [NominalModel(task.nominal, timing, self._bench.engine) for _ in range(threads)]
        self._nominals = [nominals[seat * threads // seats] for seat in range(seats)]
        ends = [-(-seats * thread // threads) for thread in range(threads + 1)]
        self._shares = [slice(first, last) for first, last in pairwise(ends)]
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self._packed = np.tile(task.actions.law.packed(), (seats, 1))
        self._rows, self._samples = np.zeros(seats, ROW), np.zeros(seats, dtype=np.int64)
        self.results = np.zeros(seats, RESULT)
        self.observations = np.zeros((seats, SEEN + len(task.actions.names)))
        self.episodes: dict[int, Episode] = {}
        self.infos: dict[int, dict[str, Any]] = {}

    @property
    def time(self) -> Array:
        """Simulated time of each episode [s], (seats,)."""
        played: Array = (self._samples - self._rows["left"]) * self._task.experiment.control_period
        return played

    @property
    def truth(self) -> dict[str, Array]:
        """What is true of each seat, by the names of an info."""
        return {"time": self.time, **{name: self.results[name] for name in TRUTH}}

    def info(self, seat: int) -> dict[str, Any]:
        """The same of one seat."""
        result, time = self.results[seat], self._samples[seat] - self._rows[seat]["left"]
        return {
            "time": float(time * self._task.experiment.control_period),
            "error": result["error"].copy(),
            "rate_error": result["rate_error"].copy(),
            "tip_error_mm": float(result["tip_error_mm"]),
            "torque": result["torque"].copy(),
        }

    def begin(self, experiments: Mapping[int, Experiment]) -> None:
        """Begins an episode on each of some seats.

        Raises:
            WristError: an experiment cannot be run.
        """
        self._rows["periods"] = -1  # the others wait
        for seat, experiment in experiments.items():
            plant, nominal = self._plants[seat], self._nominals[seat]
            plant.perturb(experiment.perturbation)
            machine = Machine(plant.model, plant.data, nominal)
            self.episodes[seat] = Episode(experiment, self._task, self._bench, machine, self._packed[seat])
            self._rows[seat] = self.episodes[seat].row()[0]
            self._samples[seat] = self.episodes[seat].samples
            self.observations[seat] = 0.0
        self._run()

    def play(self, actions: npt.ArrayLike, waiting: npt.NDArray[np.bool_] | None = None) -> None:
        """Holds an action on each seat for a frame, or to the end of an episode that is shorter.

        Args:
            actions: (seats, k).
            waiting: seats that are not played, (seats,), whose actions do not count; none where nothing is given.

        Raises:
            ParameterError: the actions have another shape, or are not finite.
            LawError: the law raises, or writes a torque that is not finite.
        """
        acted = self._checked(actions, waiting)
        self._rows["periods"] = (
            self._task.frame_skip if waiting is None else np.where(waiting, -1, self._task.frame_skip)
        )
        self._task.actions.write(acted, self._packed)
        news = self._run()
        self.observations[:, SEEN:] = acted
        self.infos = {}
        if news:
            self._attend()

    def _attend(self) -> None:
        """Concludes the episodes that are over, and draws inputs for those that need more."""
        results = self.results
        for seat in map(int, np.flatnonzero(results["terminated"] | results["truncated"])):
            self.infos[seat] = self.episodes[seat].conclude(int(self._rows[seat]["left"]), results[seat])
        for seat in map(int, np.flatnonzero(results["dry"])):
            self.episodes[seat].refill(self._rows[seat])

    def close(self) -> None:
        """Ends the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _checked(self, actions: npt.ArrayLike, waiting: npt.NDArray[np.bool_] | None) -> Array:
        """The actions within ±1, zero for waiting seats."""
        try:
            wanted = np.array(actions, dtype=np.float64)
        except (TypeError, ValueError):
            wanted = np.empty(0)
        if wanted.shape != (len(self._rows), len(self._task.actions.names)):
            raise ParameterError(
                f"action = {one_line(actions, 60)}: {len(self._task.actions.names)} numbers are needed for each wrist "
                f"({', '.join(self._task.actions.names)})"
            )
        if waiting is not None:
            wanted[waiting] = 0.0
        if not np.isfinite(wanted).all():
            raise ParameterError(f"action = {one_line(wanted.tolist(), 60)}: must be finite numbers")
        return np.minimum(1.0, np.maximum(-1.0, wanted, out=wanted), out=wanted)

    def _run(self) -> int:
        def work(share: slice) -> int:
            return int(self._play(self._rows[share], self.results[share], self.observations[share]))

        with warnings_kept_in_data():
            try:
                return sum((self._pool.map if self._pool else map)(work, self._shares))
            except Exception as error:  # nothing in the loop raises but a law, which may raise anything
                for seat in np.flatnonzero(self.results["status"] == PLAYING):
                    self.episodes[int(seat)].loop.blame(f"raised {type(error).__name__}: {one_line(error)}")
                raise
