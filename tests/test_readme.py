"""The README is true: its examples run as they stand, and its figures are those of the runs.

Blocks marked ``sh``, ``python``, ``toml`` and ``sql`` are run. Those marked ``bash`` are not: they set up the
repository itself, or need a cluster. A block whose first comment is the name of a file is that file.

Commands form chains: one that reads what an earlier one wrote with ``-o`` comes after it. Every chain is a test. By
default its commands run in this process, the long ones on a smaller task; with WRIST_THOROUGH=1 they run in a shell as
they stand.
"""

import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import duckdb
import pytest

import needs
from sampling import THOROUGH, long, some
from spherical_wrist import Experiment, simulate
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.cli import main
from spherical_wrist.control import Law
from spherical_wrist.experiment.presets import hardware

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|python|toml|sql)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
FILE = re.compile(r"# ([\w/]+\.(?:py|toml))\n")
SCRIPTS = [text for language, text in BLOCKS if language == "python" and not FILE.match(text)]
TESTS = [FILE.match(text)[1] for language, text in BLOCKS if language == "python" and text.startswith("# test_")]
QUERIES = [text for language, text in BLOCKS if language == "sql"]
SMALLER = {
    "run": ["--duration", "5"],
    "compare": ["--duration", "1", "--case", "constant-heavy", "--case", "realistic"],
    "frontier": ["--set", "duration=1"],
    "tune": ["--trials", "2", "--duration", "0.3"],
}
"""Options that make the task of a long command smaller; they replace those of the README."""


def chains():
    """Return the commands of the ``sh`` blocks, in chains of those that read what another one writes."""
    found = []
    for line in (line for language, text in BLOCKS if language == "sh" for line in text.splitlines()):
        words = shlex.split(line, comments=True)
        read = {word for before, word in pairwise(words) if before != "-o"}
        for chain in reversed(found):
            if any(word == name or word.startswith(f"{name}/") for name in written(chain) for word in read):
                chain.append(line)
                break
        else:
            found.append([line])
    return found


def written(lines):
    """Return the files and folders that commands write."""
    return re.findall(r" -o ([\w.]+)", "\n".join(lines))


CHAINS = chains()
SHORT_CHAINS = [lines for lines in CHAINS if not lines[0].startswith("wrist paper")]  # test_paper.py runs that one


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """Work in a folder that is to a reader as a clone is, with the installed command on the path."""
    for name in ("scripts", "models"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    for _, text in BLOCKS:
        if named := FILE.match(text):
            (tmp_path / named[1]).write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    return tmp_path


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"
    assert "Traceback" not in done.stderr
    return done.stdout


def run_here(line, monkeypatch):
    """Run a command line in this process, on a smaller task where it is a long one."""
    program, command, *rest = shlex.split(line, comments=True)
    assert program == "wrist"
    monkeypatch.setattr(sys, "argv", [program, command, *rest, *SMALLER.get(command, [])])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code, line


@pytest.mark.slow
@pytest.mark.skipif(THOROUGH and shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    "lines", CHAINS if THOROUGH else some(SHORT_CHAINS, 2), ids=lambda lines: lines[0].partition("#")[0].strip()
)
def test_commands_run_in_order(clone, monkeypatch, lines):
    text = "\n".join(lines)
    if "wrist view" in text:
        needs.vulkan()
    if "wrist render" in text:
        needs.opengl()
    if THOROUGH:
        run("bash", "-euo", "pipefail", "-c", text)
    else:
        campaign = clone / "scripts" / "campaign.toml"
        campaign.write_text(re.sub(r"^samples = .*$", "samples = 8", campaign.read_text(), flags=re.MULTILINE))
        for line in lines:
            run_here(line, monkeypatch)
    for made in written(lines):
        assert Path(made).stat().st_size > 1000 or list(Path(made).iterdir()), made
    for picture in re.findall(r"[\w.]+\.png", text):
        assert Path(picture).stat().st_size > 1000, picture
    for query in QUERIES:
        if any(f"'{name}/" in query for name in written(lines)):
            assert duckdb.sql(query).fetchall()


def test_every_query_has_its_campaign():
    assert QUERIES
    for query in QUERIES:
        assert any(f"'{name}/" in query for lines in CHAINS for name in written(lines))


@pytest.mark.parametrize("text", [text for text in SCRIPTS if "gymnasium" not in text], ids=lambda text: text[:40])
def test_scripts_run(clone, text):
    run(sys.executable, "-W", "error", "-c", text)


@long
def test_the_example_of_learning_learns(capsys):
    """It is short, it runs, and its gains hold on wrists that it has not seen."""
    (example,) = (text for text in SCRIPTS if "gymnasium" in text)
    assert len(example.strip().splitlines()) <= 25
    scope = {"__name__": "example"}
    exec(compile(example, "example", "exec"), scope)
    assert scope["learnt"] > scope["default"] + 0.05
    assert "with the default gains" in capsys.readouterr().out


@pytest.mark.parametrize("name", TESTS)
def test_tests_pass(clone, name):
    if THOROUGH:
        run(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", name)
    else:
        scope = runpy.run_path(name)
        for test in [test for test in scope if test.startswith("test_")]:
            scope[test]()


def test_its_files_are_valid(tmp_path):
    files = {FILE.match(text)[1]: text for language, text in BLOCKS if language == "toml"}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert Experiment.from_toml(tmp_path / "experiment.toml").disturbance.name == "noise"
    assert Campaign.from_toml(tmp_path / "wide.toml").size == 3000


def test_its_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#\s]+)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target
    anchors = {re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-") for line in README.splitlines()}
    assert set(re.findall(r"\]\(#([^)]+)\)", README)) <= anchors


def test_the_printed_table_is_that_of_the_default_run():
    metrics = simulate(Experiment()).metrics
    for value in (metrics.rms_error_rad, metrics.max_error_rad):
        assert f"{value:.3e}" in README
    for name in ("rms_tip_error_mm", "max_tip_error_mm", "chattering_Nm_per_s", "peak_torque_Nm", "max_tilt_rad"):
        assert f"{getattr(metrics, name):.4g}" in README


def rows(heading: str) -> list[list[str]]:
    """The cells of the table whose head begins with so much."""
    [table] = re.findall(rf"^\| *{re.escape(heading)}.*\n\|[-:| ]+\|\n((?:\|.*\n)+)", README, re.MULTILINE)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def law_in(cell: str) -> dict[str, Any]:
    """The law of a cell, such as ``pd`` or ``computed_torque --set law.Kp=10000``, as an experiment describes it."""
    name, *settings = re.search(r"`([^`]+)`", cell)[1].split(" --set ")
    values = dict(setting.removeprefix("law.").split("=") for setting in settings)
    return {"name": name, **{key: float(text) if text[0].isdigit() else text for key, text in values.items()}}


def of_status(status: str) -> list[str]:
    return [name for name, law in Law.members.items() if law.status == status]


WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve",
         "thirteen", "fourteen", "fifteen")  # fmt: skip
REALISTIC = hardware("realistic")


@pytest.mark.parametrize(("column", "hardware"), [(1, {}), (2, REALISTIC)], ids=["ideal", "realistic"])
def test_the_main_result_is_true(column, hardware):
    """The paper's proposal, the best of all rivals on ideal and on realistic hardware, and ours."""

    def micrometres(law):
        return 1e3 * simulate(Experiment(law=law, **hardware)).metrics.rms_tip_error_mm

    rivals = {law: micrometres(law) for law in of_status("rival")}
    found = {law_in(cells[0])["name"]: cells[column] for cells in rows("law | ideal sensors and motors")}
    own = of_status("ours")
    paper, *named = list(found)[: -len(own)]
    assert [paper, list(found)[-len(own) :]] == [Experiment().law.name, own]
    assert named[column - 1] == min(rivals, key=rivals.get), "the best on this hardware"
    for law, printed in found.items():
        assert f"{float(printed.removesuffix(' µm')):.2g}" == f"{rivals.get(law) or micrometres(law):.2g}"
    assert f"the best of {WORDS[len(rivals)]} strong rivals, `{named[0]}`" in README
    assert f"{WORDS[len(rivals)]} of their strongest\n  rivals" in README


LAWS = rows("law | RMS error [rad]")


def test_every_law_is_in_the_table_of_laws():
    as_they_are = [law_in(cells[0])["name"] for cells in LAWS if "--set" not in cells[0]]
    assert sorted(as_they_are) == sorted(Law.members)
    for cells in LAWS:
        own = Law.members[law_in(cells[0])["name"]].status == "ours"
        assert (cells[0].endswith(", ours"), cells[0].endswith(", the paper's")) == (
            own,
            cells[0].startswith(f"`{Experiment().law.name}`"),
        )


@pytest.mark.parametrize("cells", LAWS, ids=lambda cells: cells[0])
def test_the_table_of_laws_is_true(cells):
    law, rms, tip, chattering = cells
    metrics = simulate(Experiment(law=law_in(law))).metrics
    digits = f"{metrics.rms_error_rad:.1e}"
    power = str(int(digits[-3:])).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    assert f"{digits[:3]}·10{power}" == rms
    for value, printed in ((metrics.rms_tip_error_mm, tip), (metrics.chattering_Nm_per_s, chattering)):
        assert f"{value:.2g}" == f"{float(printed):.2g}"
