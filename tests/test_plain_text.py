"""Text of other people: a terminal, a picture and the viewer show it, and obey nothing in it."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from matplotlib.figure import Figure

from sampling import some
from spherical_wrist import Experiment, record, simulate
from spherical_wrist.cli.tables import Terminal
from spherical_wrist.plain_text import escaped, literal, markdown, visible
from spherical_wrist.recording.experiment_text import experiment_text

ODD = "[bold]b[/bold] :smile: \x1b[31mred\x1b]0;title\x07 \x9b2J \u202eback $a$ ![x](http://localhost/x.png) <b>"
"""Markup of Rich, codes of emoji, escape sequences, a turn of the direction of writing, mathematics, and Markdown."""
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")


@given(st.text())
def test_nothing_is_left_that_a_terminal_obeys_and_all_else_is(text):
    shown = visible(text)
    assert len(shown) == len(text)
    assert not OBEYED.search(shown)
    assert all(a == b for a, b in zip(shown, text, strict=True) if not OBEYED.match(b))


@given(st.recursive(st.text(), lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner)))
def test_json_stays_the_same_value(value):
    text = escaped(json.dumps(value, ensure_ascii=False, indent=1))
    assert not OBEYED.search(text)
    assert json.loads(text) == value


@given(st.text(alphabet=st.sampled_from("ab$\\{}_^ ")))
def test_pictures_have_no_mathematics_in_names(text):
    label = Figure().text(0.0, 0.0, literal(text))
    shown, mathematics = label._preprocess_math(label.get_text())
    assert not mathematics
    assert shown.replace("\\$", "$") == text.replace("\\$", "$")


@given(st.text(alphabet=st.sampled_from("ab _*`[]()<>!\\\n#http://.")))
def test_markdown_has_words_only(text):
    tokens = MarkdownIt().parseInline(markdown(text))
    kinds = {child.type for token in tokens for child in token.children or ()}
    assert kinds <= {"text", "text_special"}
    shown = "".join(child.content for token in tokens for child in token.children or ())
    assert shown.split() == text.split()


def test_the_terminal_shows_text_as_it_is(capsys):
    Terminal(width=300).print(ODD, soft_wrap=True)
    out = capsys.readouterr().out
    assert out.rstrip("\n") == visible(ODD)


@pytest.fixture
def odd(tmp_path):
    """Recordings whose texts are odd: the reason of the outcome, a version, a parameter, and the name of the file."""
    run = simulate(Experiment(duration=0.05, law="pd"))
    described = {**run.description, "law": {**run.description["law"], "note": ODD}}
    outcome = run.outcome._replace(reason=ODD) if hasattr(run.outcome, "_replace") else replace(run.outcome, reason=ODD)
    path = tmp_path / "[red]a.rrd"
    record(replace(run, description=described, outcome=outcome, versions={**run.versions, "mujoco": ODD}), path)
    record(run, tmp_path / "plain.rrd")
    return path


@pytest.mark.parametrize("options", [[], ["--json"]], ids=["text", "json"])
@pytest.mark.parametrize("command", ["inspect", "diff", "replay"])
def test_commands_show_odd_texts(wrist, odd, command, options):
    others = [odd.with_name("plain.rrd")] if command == "diff" else []
    _, out, err = wrist(command, odd, *others, *options)
    assert not OBEYED.search(out + err)
    assert "[bold]b[/bold]" in re.sub(r"\s+", " ", out + err) or command == "replay"
    if command != "diff":
        assert "[red]a" in out + err


def test_errors_show_odd_names(wrist):
    code, _, err = wrist("run", "--law", ODD, "--no-recording")
    assert (code, err.count("\n")) == (2, 1)
    assert not OBEYED.search(err)
    assert "[bold]b[/bold]" in err


def test_the_viewers_text_has_no_link_and_no_picture():
    description = {**Experiment().model_dump(mode="json"), "law": {"name": ODD, ODD: ODD}}
    tokens = MarkdownIt().enable("table").parse(experiment_text(description))
    kinds = {child.type for token in tokens for child in token.children or ()}
    assert kinds <= {"text", "text_special", "strong_open", "strong_close", "softbreak"}


LAW = """
from spherical_wrist.control import Law

class Mine(Law):
    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = 0.2 * signal.error[i] + 0.02 * signal.rate_error[i]
"""


@pytest.mark.parametrize("name", some(["[red]m$\\frac{$", "a$b$c", "a:smile:b", "\x1b[31m"], 4))
def test_a_law_whose_file_has_an_odd_name(wrist, tmp_path, name):
    """Its pictures and tables are drawn, and its name is in them as it is."""
    (tmp_path / f"{name}.py").write_text(LAW)
    law = ["--law", f"{name}.py:Mine"]
    code, out, err = wrist("compare", *law, "--case", "constant-heavy", "--duration", "0.3", "-o", "compared")
    assert (code, err) == (0, "")
    assert not OBEYED.search(out)
    code, _, err = wrist("run", *law, "--duration", "0.3", "-o", "a.rrd")
    assert (code, err) == (0, "")
    code, out, err = wrist("inspect", "a.rrd", "--plot", "a.svg")
    assert (code, err) == (0, "")
    assert not OBEYED.search(out)
    (tmp_path / "c.toml").write_text(
        f"laws = [{json.dumps(f'{name}.py:Mine')}]\nsamples = 4\n[experiment]\nduration = 0.1\n"
        "[vary]\nmass_scale = { uniform = [0.5, 1.5] }\n"
    )
    assert wrist("sweep", "c.toml", "-o", "c", "--workers", "0", "--threads", "1")[0] == 0
    code, out, err = wrist("report", "c")
    assert (code, err) == (0, "")
    assert not OBEYED.search(out)
    assert not OBEYED.search(Path("c", "report.html").read_text())
