"""The README is true: its examples run as they stand, and its figures are those of the runs.

Blocks marked ``sh`` and ``python`` are run. Those marked ``bash`` are not: they set up the
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

import pytest
from matplotlib.figure import Figure

import needs
from sampling import SMALLER, THOROUGH, some
from sketches import sketched
from spherical_wrist import Experiment
from spherical_wrist.cli import main
from spherical_wrist.control import Law

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|python)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
FILE = re.compile(r"# ([\w/]+\.py)\n")
FIGURES = runpy.run_path(str(ROOT / "scripts" / "figures.py"))
KEPT = FIGURES["kept"]()
SCRIPTS = [text for language, text in BLOCKS if language == "python" and not FILE.match(text)]
TESTS = [FILE.match(text)[1] for language, text in BLOCKS if language == "python" and text.startswith("# test_")]
SHORTER = SMALLER | {
    "run": ["--duration", "5"],
    "compare": ["--duration", "1", "--case", "constant-heavy", "--case", "realistic"],
}
CAMPAIGN = {"samples": "4", "duration": "0.5"}
"""Size of the campaign that is run in place of that of the README."""


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
    monkeypatch.setattr(sys, "argv", [program, command, *rest, *SHORTER.get(command, [])])
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
        monkeypatch.setattr(Figure, "savefig", sketched)
        text_of_it = campaign.read_text()
        for name, value in CAMPAIGN.items():
            text_of_it, found = re.subn(rf"^{name} = .*$", f"{name} = {value}", text_of_it, flags=re.MULTILINE)
            assert found == 1
        campaign.write_text(text_of_it)
        for line in lines:
            run_here(line, monkeypatch)
    for made in written(lines):
        assert Path(made).stat().st_size > 1000 or list(Path(made).iterdir()), made
    for picture in re.findall(r"[\w.]+\.png", text):
        assert Path(picture).stat().st_size > 1000, picture


@pytest.mark.parametrize("text", SCRIPTS, ids=lambda text: text[:40])
def test_scripts_run(clone, text):
    run(sys.executable, "-W", "error", "-c", text)


@pytest.mark.parametrize("name", TESTS)
def test_tests_pass(clone, name):
    if THOROUGH:
        run(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", name)
    else:
        scope = runpy.run_path(name)
        for test in [test for test in scope if test.startswith("test_")]:
            scope[test]()


def test_its_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#\s]+)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target
    anchors = {re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-") for line in README.splitlines()}
    assert set(re.findall(r"\]\(#([^)]+)\)", README)) <= anchors


def test_it_is_short():
    assert len(README.splitlines()) <= 200


@pytest.mark.parametrize("path", FIGURES["TEXTS"], ids=lambda path: path.name)
def test_figures_are_written_by_the_script(path):
    """Every block is that of the file of figures, which a reader can compute anew."""
    text = path.read_text(encoding="utf-8")
    assert FIGURES["written"](text, KEPT) == text, "scripts/figures.py writes them"
    names = [found[1] for found in FIGURES["BLOCK"].findall(text)]
    assert text.count("<!-- figures") == text.count("<!-- end of figures -->") == len(names)


def test_no_figure_is_written_by_hand():
    """Errors, torques and times of the README outside its blocks are those that it states as a task."""
    prose = FIGURES["BLOCK"].sub("", re.sub(r"^```.*?^```$", "", README, flags=re.DOTALL | re.MULTILINE))
    found = set(re.findall(r"\d[\d.,]*\s?(?:µm|mm|rad|ms|µs|s|Hz|kHz|%|×|times)(?![\w·])", prose))
    assert found <= {"100 µm", "0.1 mm", "0.5 rad", "10 s", "2 s", "1 kHz", "25 %"}


@pytest.mark.parametrize("row", some(KEPT["runs"]["laws"], 4), ids=lambda row: row["law"]["name"])
@pytest.mark.parametrize("condition", FIGURES["CONDITIONS"])
def test_the_figures_of_laws_are_those_of_their_runs(row, condition):
    found = FIGURES["run_of"](row["law"], condition)
    assert found == pytest.approx(row[condition], rel=1e-3)  # another processor rounds otherwise
    assert row["status"] == Law.members[row["law"]["name"]].status


def test_other_figures_are_those_of_runs():
    runs = KEPT["runs"]
    assert [row["law"]["name"] for row in runs["laws"]] == list(Law.members)
    assert runs["default_law"] == Experiment().law.name
    for row in runs["variants"]:
        assert FIGURES["run_of"](row["law"], "ideal") == pytest.approx(row["ideal"], rel=1e-3)
    for with_it, error in runs["prediction"].items():
        assert FIGURES["prediction_of"](with_it == "true") == pytest.approx(error, rel=1e-3)


def test_the_summary_is_that_of_the_command(clone, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["wrist", "run", "-o", "run.rrd"])
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        main()
    took = re.compile(r"simulated in .*")  # depends on the machine
    lines = [took.sub("", line).rstrip() for line in capsys.readouterr().out.strip().splitlines()]
    assert lines == [took.sub("", line).rstrip() for line in KEPT["runs"]["summary"].splitlines()]
