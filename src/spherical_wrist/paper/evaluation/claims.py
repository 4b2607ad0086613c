"""Claims of the paper's evaluation, each tested on the runs of the table."""

from collections.abc import Callable

from spherical_wrist.paper.evaluation.mechanics import MECHANICS
from spherical_wrist.paper.evaluation.runs import Evaluation, figure
from spherical_wrist.paper.evaluation.setting import (
    BASELINE,
    ENOUGH,
    EQUAL,
    LEVELS,
    MAIN,
    PLAIN,
    PRINTED,
    PROPOSED,
    SIGN,
    SMOOTH,
    TOO_LITTLE,
    UNEQUAL,
    VARIANTS,
    WEAK,
)
from spherical_wrist.paper.evaluation.theory import THEOREMS
from spherical_wrist.paper.evaluation.verdict import (
    MUCH,
    REDUCED,
    SAME,
    VISIBLE,
    ClaimTrial,
    Finding,
    number,
    same,
    times,
)
from spherical_wrist.reference import Sinusoid

BOTH = (BASELINE, PROPOSED)


def small_undisturbed(found: Evaluation) -> Finding:
    """Table 1, first row: the sizes."""
    trials = []
    for variant in EQUAL:
        errors = [found.error(method, variant, 0.0) for method in BOTH]
        printed = [PRINTED[method, 0.0] for method in BOTH]
        good = all(error <= limit for error, limit in zip(errors, printed, strict=True))
        fixed, tuned = (times(error, limit) for error, limit in zip(errors, printed, strict=True))
        trials.append(_trial(variant, good, f"{_pair(errors)} rad, {fixed} and {tuned} the printed value"))
    return Finding(
        f"Without disturbance the errors are small: {PRINTED[BASELINE, 0.0]:g} rad with the baseline, "
        f"{PRINTED[PROPOSED, 0.0]:g} rad with the proposal.",
        "Table 1, 0 %",
        tuple(trials),
        "It is enough that an error is not above the printed one. A smaller one does not reproduce its digits, which "
        "depend on gains that the paper does not give.",
    )


def same_undisturbed(found: Evaluation) -> Finding:
    """Table 1, first row: the two methods against each other."""
    errors = {variant: [found.error(method, variant, 0.0) for method in BOTH] for variant in EQUAL}
    ratios = {variant: tuned / fixed for variant, (fixed, tuned) in errors.items()}
    reversed_ = min(ratios.values()) < 1.0 < max(ratios.values())
    return Finding(
        "Without disturbance both methods have about the same error.",
        "Section 4, on Table 1",
        tuple(
            _trial(variant, same(tuned, fixed), f"the error of the proposal is {times(tuned, fixed)} the baseline's")
            for variant, (fixed, tuned) in errors.items()
        ),
        "Which of the two is better depends on the switching function." if reversed_ else "",
    )


def baseline_disturbed(found: Evaluation) -> Finding:
    """Table 1, second row, the baseline alone."""
    printed = PRINTED[BASELINE, 0.25]
    errors = {variant: found.error(BASELINE, variant, 0.25) for variant in EQUAL}
    return Finding(
        f"Under a 25 % disturbance the baseline is left with an error of {printed:g} rad.",
        "Table 1, 25 %",
        tuple(
            _trial(variant, same(error, printed), f"{number(error)} rad, {times(error, printed)} the printed value")
            for variant, error in errors.items()
        ),
        f"Computed torque without any sliding surface has {number(found.error(PLAIN, MAIN, 0.25))} rad.",
    )


def proposal_disturbed(found: Evaluation) -> Finding:
    """Table 1, second row, the proposal alone."""
    printed = PRINTED[PROPOSED, 0.25]
    errors = {variant: found.error(PROPOSED, variant, 0.25) for variant in EQUAL}
    return Finding(
        f"Under a 25 % disturbance the proposed method keeps its error at {printed:g} rad.",
        "Table 1, 25 %",
        tuple(
            _trial(variant, error <= printed, f"{number(error)} rad, {times(error, printed)} the printed value")
            for variant, error in errors.items()
        ),
        f"The disturbance is {number(found.disturbance)} N·m, K as written {ENOUGH} N·m. The chattering as written is "
        f"{number(found.chattering(PROPOSED, MAIN, 0.25))} N·m/s, "
        f"{times(found.chattering(PROPOSED, MAIN, 0.25), found.chattering(PLAIN, MAIN, 0.25))} that of plain computed "
        "torque.",
    )


def contrast(found: Evaluation) -> Finding:
    """Table 1, second row: contrast between the two methods."""
    printed = PRINTED[BASELINE, 0.25] / PRINTED[PROPOSED, 0.25]
    errors = {variant: [found.error(method, variant, 0.25) for method in BOTH] for variant in (*EQUAL, UNEQUAL)}
    return Finding(
        f"Tuning the slope on line makes the disturbed error {printed:.0f} times smaller "
        f"({PRINTED[BASELINE, 0.25]:g} against {PRINTED[PROPOSED, 0.25]:g} rad).",
        "Table 1, 25 %",
        tuple(
            _trial(variant, SAME * fixed >= printed * tuned, f"the baseline's is {times(fixed, tuned)} the proposal's")
            for variant, (fixed, tuned) in errors.items()
            if variant in EQUAL
        ),
        f"With K below the disturbance theory leaves (H Kp)⁻¹ (d − K) = {number(found.unresisted(TOO_LITTLE))} rad "
        f"whatever the slope; measured are {_pair(errors[WEAK])} rad. In the boundary layer the slope of the proposal "
        f"is {found.slope_ratio(SMOOTH, 0.25):.1f} times the baseline's. Different gains make another contrast: with "
        f"K = {TOO_LITTLE} N·m for the baseline and {ENOUGH} N·m for the proposal the baseline's error is "
        f"{times(*errors[UNEQUAL])} the proposal's.",
    )


def following(found: Evaluation) -> Finding:
    """Figure 1."""
    amplitude = Sinusoid().amplitude[0]
    trials = []
    for variant in EQUAL:
        worst = [figure(found.metrics(method, variant, 0.0).max_error_rad) for method in BOTH]
        trials.append(_trial(variant, max(worst) < VISIBLE * amplitude, f"largest errors {_pair(worst)} rad"))
    return Finding(
        "Without disturbance the two methods follow the trajectory equally well.",
        "Figure 1",
        tuple(trials),
        f"On sinusoids of {amplitude} rad, errors below {VISIBLE * amplitude:g} rad cannot be told apart.",
    )


def fluctuation(found: Evaluation) -> Finding:
    """Figure 2."""
    trials = []
    for variant in EQUAL:
        fixed, tuned = (found.ripple(method, variant, 0.25) for method in BOTH)
        words = f"{_pair([fixed, tuned])} rad, the proposal's {times(tuned, fixed)} the baseline's"
        trials.append(_trial(variant, tuned * MUCH <= fixed, words))
    return Finding(
        "Under the disturbance the baseline fluctuates and the proposed method does not.",
        "Figure 2, conclusion",
        tuple(trials),
        "The figures are standard deviations of the steady |e| of the baseline and the proposal.",
    )


def plain_is_not_robust(found: Evaluation) -> Finding:
    """Introduction: feedback linearisation alone."""
    calm, pushed = (found.error(PLAIN, MAIN, level) for level in LEVELS)
    words = f"{number(calm)} rad undisturbed, {number(pushed)} rad under 25 %"
    return Finding(
        "Pure feedback linearisation works with a certain model and has important drawbacks under disturbance.",
        "Introduction; eq. (14)",
        (ClaimTrial("computed torque", pushed >= MUCH * calm, words),),
        f"Theory leaves (H Kp)⁻¹ d = {number(found.unresisted(0.0))} rad.",
    )


def surface_helps(found: Evaluation) -> Finding:
    """Section 3: the sliding surface term."""
    plain = found.error(PLAIN, MAIN, 0.25)
    errors = {variant: found.error(BASELINE, variant, 0.25) for variant in EQUAL}
    return Finding(
        "A sliding-surface term in parallel makes feedback linearisation more robust.",
        "Section 3; eq. (34)–(35)",
        tuple(
            _trial(variant, error <= REDUCED * plain, f"{number(error)} rad at 25 %, {times(error, plain)} the error")
            for variant, error in errors.items()
        ),
        f"Without the term the error is {number(plain)} rad. How much it helps depends on K.",
    )


def switching_chatters(found: Evaluation) -> Finding:
    """Section 3: the price of switching."""
    trials = []
    for variant, level in ((variant, level) for variant in SIGN for level in LEVELS):
        chattering, plain = found.chattering(BASELINE, variant, level), found.chattering(PLAIN, variant, level)
        words = f"{number(chattering)} N·m/s, {times(chattering, plain)} plain computed torque"
        trials.append(_trial(variant, chattering >= MUCH * plain, words, level))
    return Finding(
        "The switching function causes high-frequency oscillation (chattering).",
        "Section 3",
        tuple(trials),
        "With K below the disturbance the surface is not reached, and the sign does not change.",
    )


def chattering_is_reduced(found: Evaluation) -> Finding:
    """Abstract: less chattering."""
    trials = []
    for variant, level in ((variant, level) for variant in EQUAL for level in LEVELS):
        fixed, tuned = (found.chattering(method, variant, level) for method in BOTH)
        words = f"{number(tuned)} N·m/s, {times(tuned, fixed)} the baseline's"
        trials.append(_trial(variant, tuned <= REDUCED * fixed, words, level))
    layer = (times(found.chattering(method, SMOOTH, 0.25), found.chattering(PLAIN, SMOOTH, 0.25)) for method in BOTH)
    return Finding(
        "The proposed control reduces the chattering around the sliding surface.",
        "Abstract",
        tuple(trials),
        "A boundary layer, which the paper does not mention, leaves the baseline and the proposal "
        f"{' and '.join(layer)} the chattering of plain computed torque, which does not switch, at 25 %.",
    )


CLAIMS: tuple[Callable[[Evaluation], Finding], ...] = (
    small_undisturbed,
    same_undisturbed,
    baseline_disturbed,
    proposal_disturbed,
    contrast,
    following,
    fluctuation,
    plain_is_not_robust,
    surface_helps,
    switching_chatters,
    chattering_is_reduced,
    *THEOREMS,
    *MECHANICS,
)


def check_claims(found: Evaluation) -> list[Finding]:
    """Check every claim against the runs."""
    return [claim(found) for claim in CLAIMS]


def _trial(variant: str, holds: bool, figures: str, level: float | None = None) -> ClaimTrial:
    at = "" if level is None else f", {100.0 * level:.0f} %"
    return ClaimTrial(f"{VARIANTS[variant].title}{at}", bool(holds), figures)


def _pair(values: list[float]) -> str:
    return " and ".join(map(number, values))
