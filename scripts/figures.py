#!/usr/bin/env python3
"""Compute every figure and picture of the README and the guides, and write them there.

usage: scripts/figures.py [runs] [suite] [speed] [pictures] [PICTURE.png ...] [--check]

Without names, all parts are computed anew; with names, these alone, and the others stay as they were. What was computed
is kept in .assets/figures.json. A text has its figures between two comments, `<!-- figures: NAME -->` and
`<!-- end of figures -->`; all of it follows from that file. With --check nothing is computed or written: the exit code
is 1 if a text is not that of the file.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / ".assets" / "figures.json"
TEXTS = [ROOT / "README.md", *sorted((ROOT / "src" / "spherical_wrist" / "guides").glob("*.md"))]
BLOCK = re.compile(r"(<!-- figures: (\w+) -->\n).*?(<!-- end of figures -->\n)", re.DOTALL)
WRIST = str(Path(sys.executable).with_name("wrist"))
Figures = dict[str, Any]

SUITE_PICTURE = "comparison.png"
"""Picture that the suite makes, with its figures."""

CONDITIONS: dict[str, Figures] = {
    "ideal": {},
    "realistic": {"hardware": "realistic"},
    "worst": {"disturbance": {"name": "worst"}},
}
"""Experiments of the main result, as changes of the default one."""

VARIANTS = (
    {"name": "computed_torque", "Kp": 10000.0, "Kv": 200.0},
    {"name": "fuzzy_sliding_computed_torque", "switching": "sign"},
)
"""Laws with other parameters that the table of laws has beside the registered ones."""


# --- Computed -------------------------------------------------------------------------------------------------------


def run_of(law: Figures, condition: str) -> Figures:
    """Metrics of one law in one of the conditions, by their names."""
    from spherical_wrist import Experiment, simulate
    from spherical_wrist.experiment.presets import hardware

    changes = dict(CONDITIONS[condition])
    changes |= hardware(changes.pop("hardware", "ideal"))
    metrics = simulate(Experiment(law=law, **changes)).metrics
    names = ("rms_error_rad", "rms_tip_error_mm", "max_tip_error_mm", "chattering_Nm_per_s")
    return {name: float(getattr(metrics, name)) for name in names}


def prediction_of(prediction: bool) -> float:
    """RMS attitude error [rad] of computed torque on a perfect model, with and without prediction."""
    from spherical_wrist import Experiment, simulate

    law = {"name": "computed_torque", "prediction": prediction}
    return float(simulate(Experiment(law=law, disturbance=0.0, mass_scale=1.0)).metrics.rms_error_rad)


def compute_runs() -> Figures:
    """Every law in every condition, and the summary that the command prints of the default run."""
    from spherical_wrist import Experiment
    from spherical_wrist.control import Law

    laws = [{"name": name} for name in Law.members]
    return {
        "laws": [
            {"law": law, "status": Law.members[law["name"]].status, **{each: run_of(law, each) for each in CONDITIONS}}
            for law in laws
        ],
        "default_law": Experiment().law.name,
        "variants": [{"law": law, "ideal": run_of(law, "ideal")} for law in VARIANTS],
        "prediction": {str(each).lower(): prediction_of(each) for each in (True, False)},
        "summary": printed("run", "-o", "run.rrd"),
    }


def printed(*arguments: str) -> str:
    """Output of a command on a terminal of 80 columns, in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"COLUMNS": "80", "NO_COLOR": "1"}
        done = subprocess.run(
            [WRIST, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=True
        )
    return "\n".join(line.rstrip() for line in done.stdout.strip().splitlines())


def compute_speed() -> Figures:
    """Medians and ratios of the benchmark."""
    command = [sys.executable, str(ROOT / "scripts" / "benchmark.py"), "loop", "start", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # a missed target is a figure too
    return {each["what"]: each["value"] for each in json.loads(done.stdout)}


def compute_suite() -> Figures:
    """The default comparison, and its picture."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([WRIST, "compare", "-o", folder], stdout=subprocess.DEVNULL, check=True)
        keep_picture(Path(folder) / "comparison.png", SUITE_PICTURE)
        comparison: Figures = json.loads((Path(folder) / "comparison.json").read_text(encoding="utf-8"))
    return {
        "laws": [{key: row[key] for key in SUITE_LAW} for row in comparison["laws"]],
        "cases": [{key: row[key] for key in SUITE_CASE} for row in comparison["cases"]],
    }


SUITE_LAW = (
    *("law", "median_ratio", "median_interval_95", "worst_ratio", "worst_case", "wins", "within_5_percent", "lost"),
)
SUITE_CASE = ("case", "discriminates", "winner", "runner_up", "runner_up_ratio", "within_5_percent", "lost_by")
"""Figures of the comparison that are kept, of each law and of each case."""


class Picture(NamedTuple):
    """Picture of the gallery.

    Attributes:
        name: its file in .assets.
        commands: what makes it, in an empty folder.
        made: the file that they leave.
        caption: what is to be seen, one sentence.
        guide: guide that it opens.
    """

    name: str
    commands: tuple[str, ...]
    made: str
    caption: str
    guide: str


SOME_LAWS = "--law slotine_li --law lqg --law fuzzy_integral_sliding --law fuzzy_observer_sliding"
GALLERY = (
    Picture(
        "wrist.gif",
        ("wrist run -o run.rrd", "wrist render run.rrd -o run.gif --from 2 --to 4 --size 320x240"),
        "run.gif",
        "A film by MuJoCo: the wrist, its desired attitude and the trail of the tip.",
        "wrist",
    ),
    Picture(
        "viewer.png",
        ("wrist run -o run.rrd", "wrist view run.rrd --screenshot view.png --at 4"),
        "view.png",
        "A recording in the Rerun viewer, photographed without a display.",
        "recordings",
    ),
    Picture(
        "sheet.png",
        ("wrist run -o run.rrd", "wrist inspect run.rrd --plot sheet.png"),
        "sheet.png",
        "The inspection sheet of a run.",
        "validation",
    ),
    Picture(
        "comparison.png",
        ("wrist compare -o compared",),
        "compared/comparison.png",
        "Every law on every case of the suite: error and chattering.",
        "comparing",
    ),
    Picture(
        "frontier.png",
        (f"wrist frontier {SOME_LAWS} -o found",),
        "found/frontier.png",
        "How far each axis may go until the bound is missed.",
        "hardware",
    ),
    Picture(
        "margins.png",
        (f"wrist margins {SOME_LAWS} --no-ranges -o stable",),
        "stable/margins.png",
        "Sensitivity of the loop, and the response of the tip to a disturbance, over frequency.",
        "conventions",
    ),
    Picture(
        "tuning.png",
        ("wrist tune slotine_li -o tuned --trials 40 --duration 2",),
        "tuned/front.png",
        "The trials of a search for gains, and the Pareto front.",
        "law",
    ),
    Picture(
        "paper.png",
        ("wrist paper -o paper",),
        "paper/figure-2.png",
        "A figure of the source paper, from runs.",
        "paper",
    ),
)
"""Pictures of README and documentation, each with the commands that make it."""


def make_picture(picture: Picture) -> None:
    """Run its commands in a folder of their own, and keep the file that they leave."""
    with tempfile.TemporaryDirectory() as folder:
        for command in picture.commands:
            program = [WRIST, *shlex.split(command)[1:]]
            subprocess.run(program, cwd=folder, stdout=subprocess.DEVNULL, check=True)
        keep_picture(Path(folder) / picture.made, picture.name)


def keep_picture(made: Path, name: str) -> None:
    """Keep a picture in .assets; a still as wide as a page shows it, in a palette, which is a tenth of the size."""
    from PIL import Image

    if made.suffix != ".png":
        shutil.copy(made, KEPT.parent / name)
        return
    with Image.open(made) as image:
        still = image.convert("RGB")
        still.thumbnail((1600, 3200))
        still.quantize(256, dither=Image.Dither.NONE).save(KEPT.parent / name, optimize=True)


def make_pictures() -> Figures:
    """All pictures but that of the suite. They have no figures."""
    for picture in GALLERY:
        if picture.name != SUITE_PICTURE:
            make_picture(picture)
    return {}


PARTS: dict[str, Callable[[], Figures]] = {
    "runs": compute_runs,
    "suite": compute_suite,
    "speed": compute_speed,
    "pictures": make_pictures,
}


# --- Written --------------------------------------------------------------------------------------------------------


def table(head: list[str], rows: list[list[str]], right: int = 1) -> str:
    """Markdown table; columns from `right` on are aligned to the right."""
    rule = ["---" if column < right else "---:" for column in range(len(head))]
    return "".join(f"| {' | '.join(row)} |\n" for row in [head, rule, *rows])


def micrometres(millimetres: float) -> str:
    """Two digits; what is not finite, or larger than the tool, is lost."""
    return f"{_two_digits(1e3 * millimetres)} µm" if millimetres < 100.0 else "lost"


def _two_digits(value: float) -> str:
    return f"{Decimal(f'{value:.1e}'):,f}"


def _power(value: float) -> str:
    digits, _, exponent = f"{value:.1e}".partition("e")
    return f"{digits}·10{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def name_of(law: Figures) -> str:
    """A law as it is typed at the command line."""
    settings = [f"--set law.{key}={value:g}" if isinstance(value, float) else f"--set law.{key}={value}"
                for key, value in law.items() if key != "name"]  # fmt: skip
    return f"`{' '.join([law['name'], *settings])}`"


def chattering_ratio(figures: Figures, row: Figures, condition: str) -> float:
    """Chattering of a law as a multiple of that of plain computed torque."""
    (plain,) = (each for each in figures["runs"]["laws"] if each["law"]["name"] == "computed_torque")
    return float(row[condition]["chattering_Nm_per_s"] / plain[condition]["chattering_Nm_per_s"])


def main_result(figures: Figures) -> str:
    """The paper's law, the rivals that are best in a condition, and ours; errors beside their worst and their price."""
    laws = figures["runs"]["laws"]
    values = {
        "ideal": lambda row: row["ideal"]["rms_tip_error_mm"],
        "realistic": lambda row: row["realistic"]["rms_tip_error_mm"],
        "worst": lambda row: row["worst"]["max_tip_error_mm"],
    }
    rivals = [row for row in laws if row["status"] == "rival"]
    best: dict[str, list[str]] = {}
    for condition, value in values.items():
        best.setdefault(min(rivals, key=value)["law"]["name"], []).append(condition)
    shown = [("the source paper's", row) for row in laws if row["law"]["name"] == figures["runs"]["default_law"]]
    shown += [
        (f"best rival, {' and '.join(best[row['law']['name']])}", row) for row in rivals if row["law"]["name"] in best
    ]
    shown += [("ours", row) for row in laws if row["status"] == "ours"]
    rows = [
        [
            f"`{row['law']['name']}`, {remark}",
            *(micrometres(value(row)) for value in values.values()),
            f"{_two_digits(chattering_ratio(figures, row, 'realistic'))} ×",
        ]
        for remark, row in shown
    ]
    return table(["law", "ideal: RMS", "realistic: RMS", "worst torque: largest", "realistic: chattering"], rows)


def suite(figures: Figures) -> str:
    """The comparison: ours, the best rivals and the paper's law; every law's worst case beside its median."""
    found = figures["suite"]
    status = {row["law"]["name"]: row["status"] for row in figures["runs"]["laws"]}
    rivals = [row["law"] for row in found["laws"] if status[row["law"]] == "rival"][:SHOWN_RIVALS]
    shown = [
        row
        for row in found["laws"]
        if row["law"] in rivals or status[row["law"]] == "ours" or row["law"] == figures["runs"]["default_law"]
    ]
    cases = len(found["cases"])
    text = (
        f"The default suite has {cases} cases: masses, payloads, torques of 0 to 40 Hz, delays, noise, lost samples, "
        "motions, wrists.\nA law is judged by its attitude and tip error as a multiple of the best law's on that case: "
        "median and worst.\n\n"
    )
    rows = [
        [
            f"`{row['law']}`",
            f"{_ratio(row['median_ratio'])} ({' – '.join(_ratio(each) for each in row['median_interval_95'])})",
            f"{_ratio(row['worst_ratio'])}, `{row['worst_case']}`",
            str(row["wins"]),
            str(row["within_5_percent"]),
            str(len(row["lost"])),
        ]
        for row in shown
    ]
    head = ["law", "median ratio to the best (95 %)", "worst ratio, on", "best on", "within 5 % on", "lost"]
    return text + table(head, rows)


SHOWN_RIVALS = 4


def _ratio(value: float | None) -> str:
    """Two or three digits; what is not finite is a loss."""
    return "lost" if value is None else f"{value:.2f}" if value < 10.0 else f"{Decimal(f'{value:.1e}'):,f}"


def laws(figures: Figures) -> str:
    """Every law on the default case, from the largest tip error to the smallest."""
    from spherical_wrist.measure.metrics import METRICS

    runs = figures["runs"]
    rows = [*runs["laws"], *runs["variants"]]
    remark = {"ours": ", ours", "paper": ", the paper's"}
    return table(
        [
            "law",
            *(METRICS[name].label_and_unit for name in ("rms_error_rad", "rms_tip_error_mm", "chattering_Nm_per_s")),
        ],
        [
            [
                name_of(row["law"]) + remark.get(row.get("status", ""), ""),
                _power(row["ideal"]["rms_error_rad"]),
                _two_digits(row["ideal"]["rms_tip_error_mm"]),
                _two_digits(row["ideal"]["chattering_Nm_per_s"]),
            ]
            for row in sorted(rows, key=lambda row: -row["ideal"]["rms_tip_error_mm"])
        ],
    )


def summary(figures: Figures) -> str:
    """The summary that the default run prints."""
    return f"```\n{figures['runs']['summary']}\n```\n"


def prediction(figures: Figures) -> str:
    """The gain of the prediction by half a period."""
    with_it, without = (figures["runs"]["prediction"][each] for each in ("true", "false"))
    return (
        f"On a perfect model computed torque tracks to {_power(with_it)} rad RMS with it, and to\n"
        f"{_power(without)} rad without it (`--set law.prediction=false`).\n"
    )


def speed(figures: Figures) -> str:
    """Times of the benchmark, with the machine that they are of."""
    found = figures["speed"]
    loop, plain = found["closed loop, fuzzy law"], found["the same in plain Python and NumPy"]
    return (
        f"A step of the closed loop takes {loop:.1f} µs, {found['closed loop / stock mj_step']:.2f} of a bare step of "
        f"MuJoCo with default settings\nand a {plain / loop:.0f}th of the same loop in plain Python and NumPy; "
        f"`wrist run` of 10 s with its recording {found[RUN_WARM]:.1f} s\nfrom shell to shell (medians and ratios of "
        "`scripts/benchmark.py` on two cores of a shared server).\n"
    )


RUN_WARM = "wrist run, 10 s with recording, warm"


BLOCKS: dict[str, Callable[[Figures], str]] = {
    each.__name__: each for each in (main_result, suite, laws, summary, prediction, speed)
}


def written(text: str, figures: Figures) -> str:
    """The text with its figures.

    Raises:
        KeyError: it names a block that there is none of.
    """
    return BLOCK.sub(lambda found: f"{found[1]}{BLOCKS[found[2]](figures)}{found[3]}", text)


def kept() -> Figures:
    """The figures of the file."""
    return json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}


def stale(figures: Figures) -> Iterator[Path]:
    """Texts that are not those of the figures."""
    for path in TEXTS:
        text = path.read_text(encoding="utf-8")
        if written(text, figures) != text:
            yield path


def main(arguments: list[str]) -> int:
    """Compute, keep and write, or check."""
    figures = kept()
    if arguments == ["--check"]:
        found = [str(path.relative_to(ROOT)) for path in stale(figures)]
        if found:
            print(f"not the figures of {KEPT.relative_to(ROOT)}: {', '.join(found)}; scripts/figures.py writes them")
        return int(bool(found))
    pictures = {picture.name: picture for picture in GALLERY}
    unknown = [name for name in arguments if name not in PARTS and name not in pictures]
    if unknown:
        valid = ", ".join((*PARTS, *pictures))
        print(f"no part {', '.join(unknown)}: choose from {valid}, or --check", file=sys.stderr)
        return 2
    for name in arguments or PARTS:
        if name in pictures:
            make_picture(pictures[name])
        elif made := PARTS[name]():
            figures[name] = made
    KEPT.write_text(json.dumps(figures, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    for path in stale(figures):
        path.write_text(written(path.read_text(encoding="utf-8"), figures), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
