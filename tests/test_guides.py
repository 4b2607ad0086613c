"""The guides are true: their examples run, in order, as they stand, and `wrist guide` shows them."""

import re
import shlex
import sys
from pathlib import Path

import duckdb
import mujoco
import pytest
from matplotlib.figure import Figure

import spherical_wrist
from sampling import SMALLER, THOROUGH, long, some
from sketches import sketched
from spherical_wrist import Experiment
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.cli import completion, main
from spherical_wrist.comparison.cases import read_cases
from spherical_wrist.guides import NAMES, read_guide
from spherical_wrist.recording.layout import FORMAT

FOLDER = Path(spherical_wrist.__file__).parent / "guides"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"(?:#|<!--)\s*([\w./]+\.(?:py|toml|xml))\b")
NOT_RUN = ("wrist view", "wrist render")
"""Commands that need a window or a graphics driver; their own tests run them, and here their options are looked up."""


@pytest.fixture
def wrist(capsys, monkeypatch, tmp_path):
    """Runs a command line in this process; gives exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    if not THOROUGH:
        monkeypatch.setattr(Figure, "savefig", sketched)

    def command(line):
        words = shlex.split(line, comments=True)
        smaller = [] if THOROUGH or "--help" in words else SMALLER.get(words[1], [])
        monkeypatch.setattr(sys, "argv", [*words, *smaller])
        with pytest.raises(SystemExit) as end:
            main()
        printed = capsys.readouterr()
        return end.value.code or 0, printed.out, printed.err

    return command


LONG = {"learning"}
"""Guides whose examples take seconds."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=[long] * (name in LONG)) for name in some(NAMES, 2)])
def test_examples_run_in_order(name, wrist, tmp_path, capsys, monkeypatch):
    before = set(sys.modules)
    scope, printed = {"__name__": "guide"}, ""
    for language, text in BLOCK.findall(read_guide(name).text):
        named = FILE.match(text)
        if named:
            (tmp_path / named[1]).write_text(text)
        if language == "python":
            run_python(text, f"{name}.md", scope if not named else {"__name__": Path(named[1]).stem})
            printed = capsys.readouterr().out
        elif language == "sh":
            for line in text.replace("\\\n", " ").splitlines():
                if line.startswith("#"):
                    continue
                if line.startswith(NOT_RUN):
                    _, known, _ = wrist(" ".join([*line.split()[:2], "--help"]))
                    assert set(re.findall(r" (--?\w[\w-]*)", line.partition("#")[0])) <= set(
                        re.findall(r"--?\w[\w-]*", known)
                    )
                else:
                    code, out, error = wrist(line)
                    printed = out + error
                    expected = 2 if line.endswith("# refused") else 1 if line.startswith("wrist diff") else 0
                    assert code == expected, f"{line}: {printed}"
        elif language == "toml":
            read = (
                read_cases if "[[case]]" in text else Campaign.from_toml if "[vary]" in text else Experiment.from_toml
            )
            assert read(tmp_path / named[1])
        elif language == "sql":
            assert duckdb.sql(text).fetchall()
        elif language == "bash":
            continue  # needs a cluster
        elif language == "xml":
            mujoco.MjModel.from_xml_path(str(tmp_path / named[1]))
        else:
            assert language == "text", f"a block of {language!r} is not checked"
            assert " ".join(text.split()) in " ".join(printed.split()), printed
    for module in set(sys.modules) - before:
        if str(getattr(sys.modules[module], "__file__", "")).startswith(str(tmp_path)):
            monkeypatch.delitem(sys.modules, module)


def run_python(text, where, scope):
    exec(compile(text, where, "exec"), scope)
    for test in [name for name in scope if name.startswith("test_")]:
        scope[test]()


@pytest.mark.parametrize("name", NAMES)
def test_no_line_is_a_comment_of_the_documentation(name):
    """MyST leaves out lines that begin with a percent sign, in the middle of a sentence too."""
    assert not re.findall(r"^\s*%.*", read_guide(name).text, re.MULTILINE)


def test_the_guide_of_recordings_has_the_number_of_the_format():
    assert f"a number, now {FORMAT}." in read_guide("recordings").text


def test_every_guide_is_listed(wrist):
    assert {path.stem for path in FOLDER.glob("*.md")} == set(NAMES)
    code, out, _ = wrist("wrist guide")
    assert code == 0
    for name in NAMES:
        assert re.search(rf"^{name} +{re.escape(read_guide(name).title)} *$", out, re.MULTILINE)


def test_raw_is_the_file(wrist):
    assert wrist("wrist guide law --raw") == (0, (FOLDER / "law.md").read_text(), "")


def test_a_guide_is_shown_without_its_markup(wrist):
    code, out, _ = wrist("wrist guide conventions")
    assert code == 0
    assert "Conventions: frames, errors, units and figures" in out
    assert "# Conventions" not in out
    assert "**world**" not in out
    assert "```" not in out


def test_an_unknown_guide_is_answered_with_the_valid_ones(wrist):
    code, out, err = wrist("wrist guide lwa")
    assert (code, out) == (2, "")
    assert err.startswith("wrist: error: unknown guide 'lwa'; did you mean 'law'?")
    assert all(name in err for name in NAMES)
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", NAMES)
def test_links_lead_somewhere(name):
    for target in re.findall(r"\]\(([^)]+)\)", read_guide(name).text):
        file, _, heading = target.partition("#")
        if "://" in target:
            continue
        text = (FOLDER / file).resolve().read_text()
        if heading:
            titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
            assert heading in {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


def test_the_shell_completes_names():
    assert completion.guides("con") == [("conventions", read_guide("conventions").title)]
    assert [name for name, _ in completion.guides("")] == list(NAMES)
