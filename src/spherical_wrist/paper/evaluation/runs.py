"""Runs behind the table and the figures, and their theoretical errors."""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from spherical_wrist.control import SlidingComputedTorque
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.paper.evaluation import setting
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.simulate import simulate


class PaperCase(NamedTuple):
    """Conditions of one run.

    Attributes:
        method: name of the law.
        variant: key of ``setting.VARIANTS``; empty for computed torque, which has no switching term.
        level: disturbance level.
    """

    method: str
    variant: str
    level: float

    @property
    def name(self) -> str:
        """Name for files."""
        parts = (self.method, self.variant, f"{100.0 * self.level:.0f}-percent")
        return "-".join(part for part in parts if part).replace("_", "-")


def experiment(case: PaperCase) -> Experiment:
    """Create the experiment of a case, from the paper's setting."""
    gains = setting.VARIANTS[case.variant].gains[case.method] if case.variant else {}
    tables: dict[str, Any] = {
        "law": {"name": case.method, **gains},
        "reference": setting.REFERENCE,
        "disturbance": {"name": "constant", "level": case.level},
        "mass_scale": 1.0,
        "duration": setting.DURATION,
        "steady_from": setting.STEADY_FROM,
    }
    return Experiment(**tables)


def cases() -> list[PaperCase]:
    """List all cases of the table, in its order."""
    switching = (setting.SLIDING, setting.BASELINE, setting.PROPOSED)
    plain = [PaperCase(setting.PLAIN, "", level) for level in setting.LEVELS]
    return plain + [
        PaperCase(method, variant, level)
        for variant in setting.VARIANTS
        for method in switching
        for level in setting.LEVELS
    ]


class Evaluation(NamedTuple):
    """Runs of all cases.

    Attributes:
        runs: runs keyed by case.
        disturbance: size d of the 25 % disturbance on every axis [N·m].
        inertia: diagonal of the nominal inertia matrix [kg·m²].
    """

    runs: dict[PaperCase, Run]
    disturbance: float
    inertia: tuple[float, float, float]

    def metrics(self, method: str, variant: str, level: float) -> Metrics:
        """Return the metrics of one case."""
        return self.runs[PaperCase(method, "" if method == setting.PLAIN else variant, level)].metrics

    def error(self, method: str, variant: str, level: float) -> float:
        """Return the RMS steady attitude error of one case [rad]."""
        return figure(self.metrics(method, variant, level).rms_error_rad)

    def chattering(self, method: str, variant: str, level: float) -> float:
        """Return the chattering of one case [N·m/s]."""
        return figure(self.metrics(method, variant, level).chattering_Nm_per_s)

    def ripple(self, method: str, variant: str, level: float) -> float:
        """Compute the standard deviation of |e| over the steady window of one case [rad]."""
        run = self.runs[PaperCase(method, variant, level)]
        steady = run.time >= setting.STEADY_FROM
        return float(np.std(np.linalg.norm(run.error[steady], axis=1)))

    def slope_ratio(self, variant: str, level: float) -> float:
        """Compute the slope of the proposal over that of the baseline, median over the steady window and the axes."""
        slopes = []
        for method in (setting.PROPOSED, setting.BASELINE):
            run = self.runs[PaperCase(method, variant, level)]
            slopes.append(np.median(run.slope[run.time >= setting.STEADY_FROM]))
        return float(slopes[0] / slopes[1])

    def unresisted(self, gain: float) -> float:
        """Compute |(H Kp)⁻¹ (d − K)| [rad]: steady error under a constant torque d above the switching gain K."""
        stiffness = np.array(self.inertia) * np.array(SlidingComputedTorque().Kp)
        return float(np.linalg.norm((self.disturbance - gain) / stiffness))


def figure(value: float | None) -> float:
    """Return a metric that a completed run must have; NaN if it has none."""
    return float("nan") if value is None else value


def evaluate() -> Evaluation:
    """Run every case."""
    runs = {case: simulate(experiment(case)) for case in cases()}
    model = Experiment().nominal().model
    data, inertia = mujoco.MjData(model), np.empty((3, 3))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, inertia)
    disturbed = runs[PaperCase(setting.PLAIN, "", setting.LEVELS[1])]
    x, y, z = np.diag(inertia).tolist()
    return Evaluation(runs, float(disturbed.disturbance[0, 0]), (x, y, z))
