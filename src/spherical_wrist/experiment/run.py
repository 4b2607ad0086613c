"""A run: what came out of an experiment."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import libc_ver, machine, python_version, system
from tempfile import TemporaryDirectory
from typing import Any

from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.evidence import Evidence
from spherical_wrist.metrics import Measurement, Metrics
from spherical_wrist.plant import Perturbation
from spherical_wrist.simulation.outcome import Outcome
from spherical_wrist.simulation.processor import processor
from spherical_wrist.simulation.series import Series
from spherical_wrist.wrist import Names, Wrist

PACKAGES = ("spherical-wrist", "mujoco", "numpy", "scipy", "numba", "llvmlite", "pydantic", "rerun-sdk")


@dataclass(frozen=True, kw_only=True)
class Run(Series):
    """What came out of an experiment: its series as attributes, how it ended and how well it tracked.

    Attributes:
        description: the experiment as plain tables, as it is recorded.
        outcome: how the run ended.
        metrics: figures of merit, always from the full series.
        measurement: what the figures depend on besides the series.
        versions: versions of the packages and the platform.
        every: the series have every ``every``-th control instant only; 1 for all.
        wall_time: time that simulating took, without compiling [s].
        evidence: the files that the experiment depends on, as they were.
    """

    description: Mapping[str, Any]
    outcome: Outcome
    metrics: Metrics
    measurement: Measurement
    versions: Mapping[str, str]
    every: int = 1
    wall_time: float = 0.0
    evidence: Evidence = field(default=Evidence(), repr=False)
    _experiment: Experiment | None = field(default=None, repr=False)

    @property
    def experiment(self) -> Experiment:
        """The experiment, made from its description where the run comes from a recording.

        Raises:
            WristError: it cannot be made here, for instance because the file of a user's own law is not there.
        """
        return self._experiment or Experiment(**self.description)

    @contextmanager
    def plant(self) -> Iterator[Wrist]:
        """The plant, of the model that was simulated: that of the evidence, wherever its file has gone to.

        The files of its meshes are there until the context is left.

        Raises:
            WristError: there is no evidence, and the experiment cannot be made here.
        """
        if "model" not in self.evidence.places:
            yield self.experiment.plant()
            return
        told = {name: self.description[name] for name in (*Perturbation._fields, *Names._fields)}
        with TemporaryDirectory() as folder:
            self.evidence.unpack(Path(folder))
            yield Experiment(**told, model=Path(folder) / self.evidence.places["model"]).plant()

    @property
    def real_time_factor(self) -> float:
        """Simulated time per time that simulating took."""
        return self.outcome.time / self.wall_time if self.wall_time > 0.0 else 0.0


def versions() -> dict[str, str]:
    """Versions of this package, of what it computes with, and of the platform."""
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:  # run from a source tree that is not installed
            found[package] = "unknown"
    return {**found, "python": python_version(), "platform": f"{system()} {machine()}"}


def circumstances() -> dict[str, str]:
    """Everything outside of an experiment that may decide the last bits of a run: versions, C library and processor."""
    library = " ".join(libc_ver()).strip() or "unknown"
    return {**versions(), "C library": library, "processor": processor()}
