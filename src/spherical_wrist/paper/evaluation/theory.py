"""Claims of the paper that are theorems, tested on runs of their own."""

import numpy as np

from spherical_wrist.control import ComputedTorque
from spherical_wrist.paper.evaluation import setting
from spherical_wrist.paper.evaluation.runs import Evaluation, PaperCase, experiment, figure
from spherical_wrist.paper.evaluation.verdict import REDUCED, VISIBLE, ClaimTrial, Finding, number, times
from spherical_wrist.paper.lyapunov import monitor, reaching
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.simulate import simulate

OFF = (0.05, -0.03, 0.04)
"""Attitude error [rad] from which the runs of this file start."""
ADAPTIVE = "adaptive_fuzzy_sliding_computed_torque"


def linear_error(_: Evaluation) -> Finding:
    """Eq. (15): computed torque on a perfect model, after an initial error."""
    run = _off(setting.PLAIN, "", 0.0)
    decay = np.sqrt(ComputedTorque().Kp[0])  # the double pole of critical damping
    expected = np.outer((1.0 + decay * run.time) * np.exp(-decay * run.time), OFF)
    worst = float(np.abs(run.error - expected).max())
    size = float(np.linalg.norm(OFF))
    words = f"from {number(size)} rad off the error is that of the analytic solution to {number(worst)} rad"
    return Finding(
        "Computed torque with a perfect model leaves the linear error dynamics ë + Kv ė + Kp e = 0.",
        "eq. (15)",
        (ClaimTrial("computed torque", worst < VISIBLE * size, f"{words}, {100.0 * worst / size:.2g} % of it"),),
        "The difference is what the torque held over 1 ms and the curvature of SO(3) leave.",
    )


def finite_reaching(_: Evaluation) -> Finding:
    """Eq. (20)–(22): sliding mode, whose equivalent part has no other way to bring S to zero, and the proposal."""
    trials = []
    for method, variant in ((m, v) for m in (setting.SLIDING, setting.PROPOSED) for v in setting.SIGN):
        run = _off(method, variant, 0.25)
        found, period = reaching(run), run.experiment.control_period
        pairs = ", ".join(f"{_time(t)} ≤ {_time(b)}" for t, b in zip(found.measured, found.bound, strict=True))
        good = bool(np.isfinite(found.bound).all() and (found.measured <= found.bound + period).all())
        trials.append(ClaimTrial(f"{setting.TITLES[method]}, {setting.VARIANTS[variant].title}", good, f"{pairs} s"))
    return Finding(
        "The sliding surface is reached in a finite time of at most |S(0)|/η.",
        "eq. (18)–(22), abstract",
        tuple(trials),
        f"From {number(float(np.linalg.norm(OFF)))} rad off at 25 %, measured time ≤ bound, per axis. There is no "
        "bound where K is not above the mismatch torque, which for the proposal contains the turning of its surface "
        "with the fuzzy slope, and its PD term.",
    )


def lyapunov_decrease(found: Evaluation) -> Finding:
    """Eq. (41)–(43), along the runs of the table."""
    along = {variant: monitor(found.runs[PaperCase(setting.PROPOSED, variant, 0.25)]) for variant in setting.EQUAL}
    needed = {variant: float(np.abs(run.mismatch).max()) for variant, run in along.items()}
    rising = float(np.mean(along[setting.MAIN].sampled_rate > 0.0))
    return Finding(
        "The law guarantees V̇ ≤ −Σ η |S|, and with it stability and robustness.",
        "eq. (36)–(43)",
        tuple(
            ClaimTrial(
                setting.VARIANTS[variant].title,
                run.failing_fraction == 0.0 and run.all_covered_fraction == 1.0,
                f"eq. (42) requires {number(needed[variant])} N·m, K is {number(float(run.K.min()))} N·m; eq. (43) "
                f"fails at {100.0 * run.failing_fraction:.0f} % of the control instants",
            )
            for variant, run in along.items()
        ),
        "For a sampled controller eq. (43) says less than it seems: the torque is held for 1 ms, and as written V "
        f"rises over {100.0 * rising:.0f} % of the periods.",
    )


def adaptation(found: Evaluation) -> Finding:
    """Adaptive mechanism of the abstract, for which the paper gives no equations."""
    trials = [ClaimTrial("as the paper has it", False, "it gives no equations of an adaptation")]
    for variant in setting.EQUAL:
        fixed = PaperCase(setting.PROPOSED, variant, 0.25)
        law = {"name": ADAPTIVE, **setting.VARIANTS[variant].gains[setting.PROPOSED]}
        error = figure(simulate(experiment(fixed).replaced(law=law)).metrics.rms_error_rad)
        before = found.error(*fixed)
        words = f"{number(before)} → {number(error)} rad at 25 %, {times(error, before)} the error"
        trials.append(
            ClaimTrial(f"our adaptation law, {setting.VARIANTS[variant].title}", error <= REDUCED * before, words)
        )
    return Finding(
        "An adaptive mechanism on the fuzzy controller improves the tracking.",
        "Abstract",
        tuple(trials),
        f"Our adaptation law is the one derived in `{ADAPTIVE}`.",
    )


THEOREMS = (linear_error, finite_reaching, lyapunov_decrease, adaptation)


def _off(method: str, variant: str, level: float) -> Run:
    return simulate(experiment(PaperCase(method, variant, level)).replaced(initial_error=OFF))


def _time(value: float) -> str:
    return number(value) if np.isfinite(value) else "∞"
