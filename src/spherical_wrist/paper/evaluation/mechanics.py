"""Claims of the paper about the motor itself: no singularities, and decoupled axes; tested on runs of their own."""

from typing import Any

import numpy as np

from spherical_wrist.actuation import SphericalMotor
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.paper.angle_chart import angles_of_attitude, condition
from spherical_wrist.paper.angle_dynamics import AngleDynamics
from spherical_wrist.paper.evaluation import setting
from spherical_wrist.paper.evaluation.runs import Evaluation, PaperCase, experiment, figure
from spherical_wrist.paper.evaluation.verdict import MUCH, VISIBLE, ClaimTrial, Finding, number
from spherical_wrist.simulation.simulate import simulate

WIDE = (0.5, 1.7, 0.5)
"""Amplitudes [rad] of α, β, γ of a motion through β = ±π/2, where the axes of α and γ coincide."""
NUDGE = 0.05
"""Attitude error [rad] about one axis whose effect on the other two is measured."""
SHIFT = (0.002, 0.0, 0.0)
"""Error of the model's centre of mass [m]."""
PLANTS: dict[str, dict[str, Any]] = {
    "perfect model": {},
    "plant 1.25 times as heavy": {"mass_scale": 1.25},
    "centre of mass 2 mm off": {"com_shift": SHIFT},
}
"""Changes of the plant that the model does not know of."""


def no_singularities(_: Evaluation) -> Finding:
    """Introduction: a large range of motion without singularities."""
    base = experiment(PaperCase(setting.PLAIN, "", 0.0))
    reference = {"name": setting.REFERENCE, "amplitude": WIDE}
    run = simulate(base.replaced(reference=reference, actuation=SphericalMotor()))
    angles = angles_of_attitude(run.attitude)
    worst, coils = figure(run.metrics.max_error_rad), figure(run.metrics.max_condition_number)
    chart = float(condition(angles).max())
    turned = np.linalg.norm(np.gradient(np.unwrap(angles, axis=0), run.time, axis=0), axis=1).max()
    rate = np.linalg.norm(run.rate, axis=1).max()
    return Finding(
        "The spherical motor has a large range of motion with no singularities in its workspace.",
        "Introduction",
        (
            ClaimTrial(
                "ball joint, attitude and body rate",
                worst < VISIBLE * max(WIDE),
                f"with computed torque the largest error is {number(worst)} rad",
            ),
            ClaimTrial(
                f"the motor's {SphericalMotor().coils} coils",
                coils < MUCH,
                f"the condition number of the torque map is at most {number(coils)}",
            ),
            ClaimTrial(
                "the paper's angles α, β, γ",
                chart < MUCH,
                f"the condition number of their rate Jacobian reaches {number(chart)} at the control instants, and "
                f"the angles turn at {number(float(turned))} rad/s where the wrist turns at {number(float(rate))} "
                "rad/s at most",
            ),
        ),
        f"Along a motion with amplitudes of {WIDE[0]}, {WIDE[1]} and {WIDE[2]} rad. The angles have a singularity of "
        "their own at β = ±π/2, which the motor does not have: eq. (1) is not valid there.",
    )


def decoupled(found: Evaluation) -> Finding:
    """Section 2, below eq. (1): each acceleration depends on its own torque alone."""
    run = found.runs[PaperCase(setting.PLAIN, "", 0.0)]
    mobility = np.linalg.inv(
        AngleDynamics.of(run.experiment.nominal()).inertia_matrix(angles_of_attitude(run.attitude))
    )
    own = np.sqrt(np.diagonal(mobility, axis1=1, axis2=2))
    share = float((np.abs(mobility) / (own[:, :, None] * own[:, None, :]) - np.eye(3)).max())
    trials = [
        ClaimTrial(
            "motor by itself, eq. (2)",
            share < VISIBLE,
            f"along the run of figure 1 the largest off-diagonal term of H⁻¹ is {_percent(share)} of the diagonal ones",
        )
    ]
    law = {"name": setting.PLAIN}
    return Finding(
        "The motor is a decoupled system: each acceleration q̈ depends on its own variable alone.",
        "Section 2, below eq. (1)",
        (*trials, *(_crosstalk_trial("computed torque", law, plant) for plant in PLANTS)),
        f"Off-diagonal terms are divided by the geometric mean of the two diagonal ones. With a law, {NUDGE} rad about "
        "one axis show in the others by the given percentage; below the negligible "
        f"{_percent(VISIBLE)} they count as decoupled.",
    )


def surface_decouples(_: Evaluation) -> Finding:
    """Section 3: decoupling in spite of the quality of the model."""
    law = {"name": setting.PROPOSED, **setting.VARIANTS[setting.MAIN].gains[setting.PROPOSED]}
    return Finding(
        "With the sliding surface the closed loop is decoupled in spite of the quality of the dynamic model.",
        "Section 3",
        tuple(_crosstalk_trial("proposal as written", law, plant) for plant in PLANTS),
        f"The same measure, from {NUDGE} rad about one axis.",
    )


MECHANICS = (no_singularities, decoupled, surface_decouples)


def _crosstalk_trial(title: str, law: dict[str, Any], plant: str) -> ClaimTrial:
    share = crosstalk(experiment(PaperCase(setting.PLAIN, "", 0.0)).replaced(law=law, **PLANTS[plant]))
    return ClaimTrial(f"{title}, {plant}", share < VISIBLE, _percent(share))


def crosstalk(described: Experiment) -> float:
    """Compute the largest effect of an initial error about one axis on the others, as a fraction of that error.

    The effect is the difference between the runs with and without the initial error.
    """
    short = described.replaced(duration=1.0, steady_from=0.5)
    undisturbed = simulate(short).error
    largest = 0.0
    for axis in range(3):
        start = tuple(NUDGE if i == axis else 0.0 for i in range(3))
        effect = np.abs(simulate(short.replaced(initial_error=start)).error - undisturbed).max(axis=0)
        largest = max(largest, float(np.delete(effect, axis).max()) / NUDGE)
    return largest


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
