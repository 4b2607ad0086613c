"""Report with the table, the figures and the verdicts; all of its numbers are computed."""

from pathlib import Path
from typing import Any

from spherical_wrist.files import make_folder, write_together
from spherical_wrist.paper.evaluation import figures, setting
from spherical_wrist.paper.evaluation.claims import check_claims
from spherical_wrist.paper.evaluation.runs import Evaluation, PaperCase, evaluate
from spherical_wrist.paper.evaluation.verdict import THRESHOLDS, Finding, number
from spherical_wrist.recording.runs import record
from spherical_wrist.simulation.run import versions

FIGURE_1 = (
    "Without disturbance, with sign switching as written. Above, the desired angles in grey, and both methods in "
    "dashes that take turns, since they coincide. In the middle, how far each angle is off; below, the attitude error."
)
FIGURE_2 = (
    "A constant disturbance of 25 %, with sign switching as written on the left, in the boundary layer on the right. "
    "Above, the attitude error; in the middle, the envelope that the torque fills, shaded for the baseline, as edges "
    "for the proposal; below, single switches."
)
RULES = (
    "The 21 rules of the proposal: fuzzy sets of the error and its rate, rule weights, and the slope that they make."
)
RECORDINGS = "recordings"
DRAWN = ("", setting.MAIN, setting.SMOOTH)
"""Variants that the figures show, and whose runs are recorded."""


def regenerate(folder: Path) -> dict[str, Any]:
    """Run the evaluation, and write report.md, both figures and the recordings behind them.

    Args:
        folder: folder to write to; created if it does not exist.

    Returns:
        The same as plain tables: the setting, the table's entries, the claims, and the names of the files.

    Raises:
        RecordingError: the folder cannot be made, or a file in it cannot be written.
    """
    make_folder(folder)
    make_folder(folder / RECORDINGS)
    found = evaluate()
    findings = check_claims(found)
    recorded = [_record(found, case, folder) for case in found.runs if case.variant in DRAWN]
    contents = {"report.md": (text(found, findings) + "\n").encode(), **figures.files(found)}
    write_together({folder / name: content for name, content in contents.items()})
    return {
        "disturbance_Nm": found.disturbance,
        "table": [entry(found, case) for case in found.runs],
        "claims": [
            {
                "claim": f.claim,
                "source": f.source,
                "verdict": str(f.verdict),
                "trials": [trial._asdict() for trial in f.trials],
                "evidence": f.evidence,
            }
            for f in findings
        ],
        "versions": versions(),
        "files": [*contents, *recorded],
    }


def entry(found: Evaluation, case: PaperCase) -> dict[str, Any]:
    """Return one entry of the table as plain data."""
    metrics = found.runs[case].metrics
    return {
        "method": case.method,
        "variant": case.variant or None,
        "title": setting.VARIANTS[case.variant].title if case.variant else None,
        "disturbance_level": case.level,
        "outcome": str(found.runs[case].outcome.status),
        "rms_error_rad": metrics.rms_error_rad,
        "max_error_rad": metrics.max_error_rad,
        "chattering_Nm_per_s": metrics.chattering_Nm_per_s,
        "printed_error_rad": setting.PRINTED.get((case.method, case.level)),
    }


def text(found: Evaluation, findings: list[Finding]) -> str:
    """Write the report as Markdown."""
    made_with = ", ".join(f"{name} {version}" for name, version in versions().items())
    paragraphs = (
        "# The paper's evaluation, regenerated",
        _about(found),
        "## Verdicts",
        _verdicts(findings),
        THRESHOLDS,
        "## Table 1: precision",
        _table(found),
        "## Figure 1: trajectory following",
        "![Angles and error without disturbance](figure-1.png)",
        FIGURE_1,
        "## Figure 2: disturbance rejection",
        "![Error and torque under the disturbance](figure-2.png)",
        FIGURE_2,
        "## The fuzzy rules",
        "![Membership functions, rule weights and slope](rules.png)",
        RULES,
        "## Evidence",
        *map(_evidence, findings),
        f"Made with {made_with}. The runs behind the figures are in `recordings/`, for `wrist inspect` to check.",
    )
    return "\n\n".join(paragraphs)


def _about(found: Evaluation) -> str:
    listed = "\n".join(f"- **{variant.title}**: {variant.meaning}" for variant in setting.VARIANTS.values())
    return (
        "The paper gives no inertia, gains, λ, K, membership functions, disturbance shape or trajectory. They are "
        "chosen once, for both of its methods, in `spherical_wrist/paper/evaluation/setting.py`: the package's wrist "
        "and default gains, sinusoids of the angles α, β, γ, and a constant torque of 25 % of the peak nominal torque, "
        f"that is {number(found.disturbance)} N·m on every axis. Errors are RMS over t ≥ {setting.STEADY_FROM:g} s of "
        f"runs of {setting.DURATION:g} s. Four variants fill in the rest:\n\n{listed}"
    )


def _verdicts(findings: list[Finding]) -> str:
    rows = [" ".join(("|", _cell(f.claim), "|", _cell(f.source), "|", f"**{f.verdict}** |")) for f in findings]
    return "\n".join(["| claim | where | verdict |", "|---|---|---|", *rows])


def _evidence(finding: Finding) -> str:
    rows = [f"- {'holds' if t.holds else 'fails'}, {t.condition}: {t.figures}" for t in finding.trials]
    return "\n\n".join(
        part
        for part in (
            f"**{finding.claim}** ({finding.source}): *{finding.verdict}*.",
            "\n".join(rows),
            finding.remark,
        )
        if part
    )


def _table(found: Evaluation) -> str:
    rows = [
        "| variant | method | 0 %: error [rad] | chattering [N·m/s] | 25 %: error [rad] | chattering [N·m/s] |",
        "|---|---|---:|---:|---:|---:|",
    ]
    pairs = dict.fromkeys((case.variant, case.method) for case in found.runs)
    for variant, method in pairs:
        cells = [
            f"{number(found.error(method, variant, level))} | {number(found.chattering(method, variant, level))}"
            for level in setting.LEVELS
        ]
        title = setting.VARIANTS[variant].title if variant else "any"
        rows.append(f"| {title} | {setting.TITLES[method]} | {' | '.join(cells)} |")
    for method in (setting.BASELINE, setting.PROPOSED):
        printed = [f"{number(setting.PRINTED[method, level])} | not given" for level in setting.LEVELS]
        rows.append(f"| *as printed in the paper* | {setting.TITLES[method]} | {' | '.join(printed)} |")
    return "\n".join(rows)


def _record(found: Evaluation, case: PaperCase, folder: Path) -> str:
    name = f"{RECORDINGS}/{case.name}.rrd"
    record(found.runs[case], folder / name)
    return name


def _cell(words: str) -> str:
    """Escape the characters that end a cell of a Markdown table."""
    return words.replace("|", "\\|")
