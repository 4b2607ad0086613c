"""Run: the result of an experiment."""

import atexit
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from platform import libc_ver, machine, python_version, system
from shutil import rmtree
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, ClassVar

from spherical_wrist.consent import is_code, without_code
from spherical_wrist.errors import RecordingError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.embedded_files import EmbeddedFiles, files_named
from spherical_wrist.experiment.perturbation import Perturbation
from spherical_wrist.loop.machine_code import processor
from spherical_wrist.loop.outcome import Outcome
from spherical_wrist.measure.metrics import Metrics, MetricSettings
from spherical_wrist.measure.series import Series
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.result import Result
from spherical_wrist.simulation.verdict import Verdict, verdict
from spherical_wrist.versions import package_version
from spherical_wrist.wrist import Names, Wrist

AGENT = "agent"
"""Name of the law in the description of a run in which an agent acted; it cannot be simulated again without it."""

PACKAGES = ("spherical-wrist", "mujoco", "numpy", "scipy", "numba", "llvmlite", "pydantic", "rerun-sdk")


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Run(Result, Series):
    """Result of an experiment: its channels as attributes, how it ended and how well it tracked.

    Attributes:
        description: the experiment as plain tables, as it is recorded.
        outcome: how the run ended.
        metrics: figures of merit, always from the full series.
        measurement: settings of the metrics.
        versions: versions of the packages and the platform.
        warnings: sentences about what makes the figures doubtful, none where everything is right; see
            :mod:`spherical_wrist.measure.warnings`.
        every: the series have every ``every``-th control instant only; 1 for all.
        wall_time: time that simulating took, without compiling [s].
        embedded_files: files that the experiment depends on, as they were.
        trusted: of a run from a recording, the Python code that it carries may run.
    """

    view: ClassVar[str] = "spherical_wrist.api.run_view:RunView"

    description: Mapping[str, Any]
    outcome: Outcome
    metrics: Metrics
    measurement: MetricSettings
    versions: Mapping[str, str]
    warnings: tuple[str, ...] = ()
    every: int = 1
    wall_time: float = 0.0
    embedded_files: EmbeddedFiles = field(default=EmbeddedFiles(), repr=False)
    trusted: bool = field(default=False, repr=False)
    _experiment: Experiment | None = field(default=None, repr=False)

    @cached_property
    def experiment(self) -> Experiment:
        """Experiment; of a run from a recording, made from its description and the files that it carries, no others.

        Those files are unpacked to a folder that is there until this process ends.

        Raises:
            RecordingError: it names files that the recording does not carry, or Python code that is not trusted.
            WristError: it cannot be made here.
        """
        if self._experiment is not None:
            return self._experiment
        code = [part for part, file in files_named(self.description).items() if is_code(file)]
        if code and not self.trusted:
            raise RecordingError(
                f"Python code that it carries would run as its {' and '.join(code)}: read it "
                "(wrist replay --extract DIR), and allow it with --trust, or load_recording(path, trust=True)"
            )
        folder = Path(mkdtemp(prefix="recording-"))
        atexit.register(rmtree, folder, ignore_errors=True)
        self.embedded_files.unpack(folder)
        with nullcontext() if self.trusted else without_code():
            return Experiment(**self.embedded_files.described(self.description, folder))

    @property
    def verdict(self) -> Verdict:
        """Verdict on the run: the sentence with which a summary begins."""
        return verdict(self.outcome, self.metrics, self.measurement, self.warnings)

    @contextmanager
    def plant(self) -> Iterator[Wrist]:
        """Load the plant from the embedded model; its file on disk may have changed or be gone.

        The files of its meshes exist until the context is left.

        Raises:
            WristError: there is no embedded model, and it is not the default one.
        """
        if self._experiment is not None and "model" not in self.embedded_files.places:
            yield plant_of(self._experiment)
            return
        entries: dict[str, Any] = {name: self.description.get(name) for name in (*Perturbation._fields, *Names._fields)}
        with TemporaryDirectory() as folder:
            self.embedded_files.unpack(Path(folder))
            yield plant_of(Experiment(**entries, model=self.embedded_files.model(self.description, Path(folder))))

    def headline(self) -> str:
        """Return law, reference and verdict in one line."""
        law, reference = (str(self.description[part]["name"]).rpartition("/")[2] for part in ("law", "reference"))
        return f"{law} on {reference}, {self.outcome.time:g} s: {self.verdict}"

    @property
    def real_time_factor(self) -> float:
        """Ratio of simulated time to wall time."""
        return self.outcome.time / self.wall_time if self.wall_time > 0.0 else 0.0


def versions() -> dict[str, str]:
    """Versions of this package, of its numerical libraries, and of the platform."""
    packages = {package: package_version(package) for package in PACKAGES}
    return {**packages, "python": python_version(), "platform": f"{system()} {machine()}"}


def circumstances() -> dict[str, str]:
    """Everything outside of an experiment that may decide the last bits of a run: versions, C library and processor."""
    return {**versions(), "C library": _c_library(), "processor": processor()}


@cache
def _c_library() -> str:
    return " ".join(libc_ver()).strip() or "unknown"
