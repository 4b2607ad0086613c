"""Claims of the paper's evaluation, each with a verdict computed from the runs of the table."""

from collections.abc import Callable

from spherical_wrist.paper.evaluation.runs import Evaluation, figure
from spherical_wrist.paper.evaluation.setting import (
    BASELINE,
    ENOUGH,
    MAIN,
    PLAIN,
    PRINTED,
    PROPOSED,
    SMOOTH,
    TOO_LITTLE,
    UNEQUAL,
    WEAK,
)
from spherical_wrist.paper.evaluation.theory import THEOREMS
from spherical_wrist.paper.evaluation.verdict import Finding, Verdict, number
from spherical_wrist.reference import Sinusoid


def undisturbed(found: Evaluation) -> Finding:
    """Table 1, first row."""
    errors = {method: found.error(method, MAIN, 0.0) for method in (BASELINE, PROPOSED)}
    good = all(errors[method] <= PRINTED[method, 0.0] for method in errors)
    return Finding(
        "Without disturbance both methods track with about the same small error "
        f"({PRINTED[BASELINE, 0.0]:g} and {PRINTED[PROPOSED, 0.0]:g} rad).",
        "Table 1, 0 %",
        Verdict.REPRODUCED if good else Verdict.NOT_REPRODUCED,
        f"As written, the baseline is left with {number(errors[BASELINE])} rad and the proposal with "
        f"{number(errors[PROPOSED])} rad RMS.",
    )


def disturbed(found: Evaluation) -> Finding:
    """Table 1, second row, the proposal alone."""
    error, limit = found.error(PROPOSED, MAIN, 0.25), PRINTED[PROPOSED, 0.25]
    return Finding(
        f"Under a 25 % disturbance the proposed method keeps its error at {limit:g} rad.",
        "Table 1, 25 %",
        Verdict.CONDITIONAL if error <= limit else Verdict.NOT_REPRODUCED,
        f"{number(error)} rad, as written: with sign switching, K = {ENOUGH} N·m above the disturbance of "
        f"{number(found.disturbance)} N·m, and {number(found.chattering(PROPOSED, MAIN, 0.25))} N·m/s of chattering "
        f"against {number(found.chattering(PLAIN, MAIN, 0.25))} N·m/s of plain computed torque. In the smooth boundary "
        f"layer it is {number(found.error(PROPOSED, SMOOTH, 0.25))} rad, with "
        f"{number(found.chattering(PROPOSED, SMOOTH, 0.25))} N·m/s.",
    )


def contrast(found: Evaluation) -> Finding:
    """Table 1, second row: contrast between the two methods."""
    errors = {
        variant: [found.error(method, variant, 0.25) for method in (BASELINE, PROPOSED)]
        for variant in (MAIN, WEAK, SMOOTH, UNEQUAL)
    }
    ratio = {variant: fixed / tuned for variant, (fixed, tuned) in errors.items()}
    printed = PRINTED[BASELINE, 0.25] / PRINTED[PROPOSED, 0.25]
    same_law = max(ratio[MAIN], ratio[WEAK], ratio[SMOOTH])
    return Finding(
        f"Tuning the slope on line makes the disturbed error {printed:.0f} times smaller "
        f"({PRINTED[BASELINE, 0.25]:g} against {PRINTED[PROPOSED, 0.25]:g} rad).",
        "Table 1, 25 %",
        Verdict.REPRODUCED if same_law >= printed else Verdict.NOT_REPRODUCED,
        f"At equal K the ratio is {ratio[MAIN]:.1f} with sign switching and K above the disturbance, and "
        f"{ratio[WEAK]:.2f} with K below it: both methods then stay at (H Kp)⁻¹ (d − K) = "
        f"{number(found.unresisted(TOO_LITTLE))} rad (measured {number(found.error(BASELINE, WEAK, 0.25))} and "
        f"{number(found.error(PROPOSED, WEAK, 0.25))} rad). In a boundary layer it is {ratio[SMOOTH]:.1f}, the ratio "
        "of the slopes. A contrast like the paper's appears only where the two methods have different switching gains: "
        f"with K = {TOO_LITTLE} N·m for the baseline and {ENOUGH} N·m for the proposal it is {ratio[UNEQUAL]:.0f}.",
    )


def following(found: Evaluation) -> Finding:
    """Figure 1."""
    worst = {method: figure(found.metrics(method, MAIN, 0.0).max_error_rad) for method in (BASELINE, PROPOSED)}
    amplitude = Sinusoid().amplitude[0]
    good = all(error < 0.01 * amplitude for error in worst.values())
    return Finding(
        "Without disturbance the two methods follow the trajectory equally well.",
        "Figure 1",
        Verdict.REPRODUCED if good else Verdict.NOT_REPRODUCED,
        f"On sinusoids of {amplitude} rad the largest errors are {number(worst[BASELINE])} and "
        f"{number(worst[PROPOSED])} rad: the curves cannot be distinguished.",
    )


def fluctuation(found: Evaluation) -> Finding:
    """Figure 2."""
    ripple = {
        (method, variant): found.ripple(method, variant, 0.25)
        for method in (BASELINE, PROPOSED)
        for variant in (MAIN, SMOOTH)
    }
    calmer = ripple[PROPOSED, MAIN] < 0.5 * ripple[BASELINE, MAIN]
    return Finding(
        "Under the disturbance the baseline fluctuates and the proposed method does not.",
        "Figure 2, conclusion",
        Verdict.REPRODUCED if calmer else Verdict.NOT_REPRODUCED,
        f"As written, the steady error varies (standard deviation of |e|) by {number(ripple[BASELINE, MAIN])} rad for "
        f"the baseline and by {number(ripple[PROPOSED, MAIN])} rad for the proposal, since both switch; in the "
        f"boundary layer by {number(ripple[BASELINE, SMOOTH])} and {number(ripple[PROPOSED, SMOOTH])} rad.",
    )


def plain_is_not_robust(found: Evaluation) -> Finding:
    """Introduction: feedback linearisation alone."""
    calm, pushed = (found.error(PLAIN, MAIN, level) for level in (0.0, 0.25))
    return Finding(
        "Pure feedback linearisation works with a certain model and has important drawbacks under disturbance.",
        "Introduction; eq. (14)",
        Verdict.REPRODUCED if pushed > 100.0 * calm else Verdict.NOT_REPRODUCED,
        f"Computed torque: {number(calm)} rad undisturbed, {number(pushed)} rad disturbed; (H Kp)⁻¹ d is "
        f"{number(found.unresisted(0.0))} rad.",
    )


def surface_helps(found: Evaluation) -> Finding:
    """Section 3: the sliding surface term."""
    plain, written = found.error(PLAIN, MAIN, 0.25), found.error(BASELINE, MAIN, 0.25)
    weak = found.error(BASELINE, WEAK, 0.25)
    return Finding(
        "A sliding-surface term in parallel makes feedback linearisation more robust.",
        "Section 3; eq. (34)–(35)",
        Verdict.CONDITIONAL if written < 0.1 * plain else Verdict.NOT_REPRODUCED,
        f"{number(plain)} → {number(written)} rad at 25 %, as long as K exceeds the disturbance; with K below it "
        f"{number(weak)} rad remain.",
    )


def switching_chatters(found: Evaluation) -> Finding:
    """Section 3: the price of switching."""
    ratio = found.chattering(BASELINE, MAIN, 0.25) / found.chattering(PLAIN, MAIN, 0.25)
    return Finding(
        "The switching function causes high-frequency oscillation (chattering).",
        "Section 3",
        Verdict.REPRODUCED if ratio > 10.0 else Verdict.NOT_REPRODUCED,
        f"{number(found.chattering(BASELINE, MAIN, 0.25))} N·m/s, {ratio:.0f} times plain computed torque.",
    )


def chattering_is_reduced(found: Evaluation) -> Finding:
    """Abstract: less chattering."""
    written = found.chattering(PROPOSED, MAIN, 0.25) / found.chattering(BASELINE, MAIN, 0.25)
    smooth = found.chattering(PROPOSED, SMOOTH, 0.25) / found.chattering(PLAIN, MAIN, 0.25)
    verdict = Verdict.CONDITIONAL if smooth < 1.5 else Verdict.NOT_REPRODUCED
    return Finding(
        "The proposed control reduces the chattering around the sliding surface.",
        "Abstract",
        Verdict.REPRODUCED if written < 0.5 else verdict,
        f"As written (sign) it chatters {written:.2f} times as much as the baseline at 25 %. With the sign replaced by "
        f"a boundary layer, which the paper does not mention, its torque has {smooth:.2f} times the total variation of "
        "that of plain computed torque, which has no switching term.",
    )


CLAIMS: tuple[Callable[[Evaluation], Finding], ...] = (
    undisturbed,
    disturbed,
    contrast,
    following,
    fluctuation,
    plain_is_not_robust,
    surface_helps,
    switching_chatters,
    chattering_is_reduced,
    *THEOREMS,
)


def check_claims(found: Evaluation) -> list[Finding]:
    """Check every claim against the runs."""
    return [claim(found) for claim in CLAIMS]
