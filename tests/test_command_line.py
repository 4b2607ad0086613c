"""The command line in its first minute: help, lists, options that are alike everywhere, and answers to near misses."""

import json
import re
from io import StringIO
from pathlib import Path

import pytest
import typer
from rich.console import Console
from rich.markdown import Markdown

from rigs import one_line
from spherical_wrist.cli.app import COMMANDS, GROUPS, _imported, app
from spherical_wrist.cli.list import kinds
from spherical_wrist.control import Law
from spherical_wrist.experiment.description import PARTS, Experiment
from spherical_wrist.guides import NAMES, read_guide

SHARED = ("--model", "--reference", "--hardware", "--set", "--duration", "--seed")
OWN_EXPERIMENT = {
    "list": "looks things up",
    "guide": "looks things up",
    "view": "shows a recording",
    "inspect": "shows a recording",
    "diff": "compares recordings",
    "render": "films a recording, whose experiment is in it",
    "replay": "runs the experiment in a recording, as it was",
    "report": "reads a campaign, whose experiment is in it",
    "design": "measures by one criterion, whose experiments are the same for every law",
    "paper": "runs the evaluation of the paper, whose conditions are its own",
}
"""Commands without an experiment of the caller's, and why."""
CAMPAIGN = 'samples = 2\ndesign = "random"\n[experiment]\nlaw = "pd"\n[vary]\npayload = { uniform = [0, 0.01] }\n'
MINE = """
from spherical_wrist.control import Law

class Mine(Law):
    \"\"\"Spring of one's own.\"\"\"
    stiffness: float = 0.1

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = parameters.stiffness * signal.error[i] + 0.004 * signal.rate_error[i]
"""


@pytest.fixture(scope="module")
def commands():
    return {name: _imported(name) for name in COMMANDS}


@pytest.fixture(autouse=True)
def eighty_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


def options_of(command):
    return {flag for option in command.params for flag in (*option.opts, *option.secondary_opts)}


def test_every_command_that_runs_something_takes_the_same_options(commands):
    missing = {
        name: sorted(set(SHARED) - options_of(command))
        for name, command in commands.items()
        if name not in OWN_EXPERIMENT and not set(SHARED) <= options_of(command)
    }
    assert missing == {}
    assert OWN_EXPERIMENT.keys() <= commands.keys()
    idle = {
        name: sorted({"--model", "--reference", "--hardware"} & options_of(commands[name])) for name in OWN_EXPERIMENT
    }
    assert {name for name, found in idle.items() if found} == set()


@pytest.mark.parametrize("name", [name for name in COMMANDS if name not in OWN_EXPERIMENT])
def test_the_shared_options_are_heard(name, wrist):
    """A model that does not exist, hardware that does not, a reference that does not: each command says which."""
    law = {"tune": ["pd"], "ablate": ["fuzzy_observer_sliding"], "run": ["--law", "pd"]}.get(name, ["--law", "pd"])
    if name == "sweep":
        law = ["c.toml"]
    if name == "plot":
        law += ["-o", "a.png"]
    for option, value in (("--hardware", "perfect"), ("--model", "none.xml"), ("--set", "mass_scale=-1")):
        Path("c.toml").write_text(CAMPAIGN)
        code, out, err = wrist(name, *law, option, value)
        assert (code, out) == (2, ""), (option, err)
        assert value.partition("=")[0] in err
        one_line(err.rstrip())


def test_every_command_can_be_quiet_and_verbose(commands):
    for name, command in commands.items():
        assert {"-q", "--quiet", "-v", "--verbose"} <= options_of(command), name


def test_without_arguments_the_command_shows_its_help_and_succeeds(wrist):
    code, out, err = wrist()
    assert (code, err) == (0, "")
    assert out == wrist("--help")[1]
    lines = out.splitlines()
    assert max(map(len, lines)) <= 80
    places = [next(number for number, line in enumerate(lines) if line == f"{group}:") for group in GROUPS]
    assert places == sorted(places)
    for name, summary in COMMANDS.items():
        assert any(re.fullmatch(rf"  {name} +{re.escape(summary)}", line) for line in lines), name


def test_each_command_has_a_module_and_a_group(commands):
    assert sum(map(len, GROUPS.values())) == len(COMMANDS) == len(commands)
    assert isinstance(app, typer.Typer)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_default_is_printed_once(name, wrist):
    code, out, _ = wrist(name, "--help")
    assert code == 0
    assert "[default:" not in out
    text = re.sub(r"\s+", " ", out.partition("Options:")[2])
    text = re.sub(r"\[[\d.<=>x]+\]", "", text)  # the range that is valid
    entries = re.split(r" (?=(?:-\w, )?--[a-z])", text)
    twice = [entry for entry in entries if len(re.findall(r"\[[^\]]*\]", entry.partition("  ")[2] or entry)) > 1]
    assert twice == []


NEAR = {
    "plot a.rrd": "wrist plot a.rrd -o errors.pdf",
    "draw a.rrd": "wrist plot a.rrd -o OUT.pdf",
    "info": "wrist inspect FILE.rrd",
    "info a.rrd": "wrist inspect a.rrd",
    "mail.rrd": "wrist inspect mail.rrd, or wrist view mail.rrd",
    "mine.py": "wrist run --law mine.py",
    "mine.py:Mine": "wrist run --law mine.py:Mine",
    "wrist.xml": "wrist run --model wrist.xml",
    "pd": "wrist run --law pd",
    "lissajous": "wrist run --reference lissajous",
    "compar --law pd": "wrist compare --law pd",
    "help": "wrist --help",
    "video a.rrd": "wrist render a.rrd",
    "benchmark": "wrist compare",
    "compare mine.py:Mine": "wrist compare --law mine.py:Mine",
    "margins mine.py": "wrist margins --law mine.py",
    "run pd": "wrist run --law pd",
    "run motion.csv": "wrist run --reference recorded:motion.csv",
    "run my.xml": "wrist run --model my.xml",
    "run old.rrd": "wrist replay",
    "run --set Kp=3": "law.Kp",
    "run --set bandwith=3": "parameter 'bandwith'",
    "run --Kp 3": "wrist run --set law.Kp=VALUE",
    "run --law mine.py:Mine --set stiffness=3": "did you mean 'law.stiffness'",
    "run --law me=mine.py --set stifness=3": "did you mean 'law.stiffness'",
    "run --law mine.py --stiffness 3": "--set law.stiffness=VALUE",
    "compare --law mine.py:Mine --set stiffness=3": "did you mean 'law.stiffness'",
    "frontier --law mine.py:Mine --set stiffness=3": "did you mean 'law.stiffness'",
    "run --disturbance 0.1 --set levle=3": "did you mean 'disturbance.level'",
    "run --reference beating_heart --set breath_rat=1": "did you mean 'reference.breath_rate'",
    "run --set duratoin=3": "did you mean 'duration'",
    "run --durration 3": "--duration",
    "run --law slotine": "'slotine_li'",
    "run --law Mine": "mine.py:Mine",
    "run --law Own": "path/to/file.py:Own",
    "run --law mine.py:Nine": "'Mine'",
    "run --law two.py": "two.py:Mine and two.py:Other",
    "run --law pd --set law.stifness=1": "unknown parameter 'stifness'",
    "tune --law pd": "wrist tune LAW",
    "list law slotine": "'slotine_li'",
    "list lws": "'laws'",
    "run -q -v": "--quiet and --verbose",
}


@pytest.mark.parametrize("line", NEAR)
def test_a_near_miss_is_answered_with_the_right_command(line, wrist, tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "two.py").write_text(MINE + MINE.partition("import Law\n")[2].replace("Mine", "Other"))
    code, out, err = wrist(*line.split())
    assert (code, out) == (2, "")
    one_line(err.rstrip())
    assert NEAR[line] in err


def test_a_file_with_one_law_needs_no_name(wrist, tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    code, out, _ = wrist("list", "law", "mine.py")
    assert code == 0
    assert "Spring of one's own." in out
    assert "law.stiffness" in out
    assert Experiment(law=str(tmp_path / "mine.py")).law.name == "mine"


def test_a_file_is_not_run_to_find_a_class_in_it(wrist, tmp_path):
    (tmp_path / "evil.py").write_text("open('ran', 'w').close()\nclass Evil: pass\n")
    assert "evil.py:Evil" in wrist("run", "--law", "Evil")[2]
    assert not (tmp_path / "ran").exists()


def test_quiet_prints_only_warnings_errors_and_json(wrist):
    short = ("--duration", 0.1, "--law", "pd")
    assert wrist("run", *short, "-q") == (0, "", "")
    code, out, err = wrist("-q", "run", *short, "--disturbance", 100)
    assert (code, out) == (0, "")
    assert err.startswith("wrist: warning: "), "a doubtful run is never silent"
    assert json.loads(wrist("run", "-q", "--json", *short)[1])["outcome"] == "completed"
    code, out, err = wrist("run", "-q", "--law", "none")
    assert (code, out) == (2, "")
    one_line(err.rstrip())
    assert "attitude error" in wrist("run", *short)[1]


def test_verbose_tells_the_stages_with_times(wrist):
    code, _, err = wrist("run", "-v", "--duration", 0.1, "--law", "pd", "-o", "a.rrd")
    assert code == 0
    for stage in (r"prepared 1 run: [\d.e-]+ s", r"simulated 0.1 s: [\d.e-]+ s", r"written to a.rrd: [\d.e-]+ s"):
        assert re.search(stage, err), stage
    assert wrist("run", "--duration", 0.1, "--law", "pd")[2] == ""


def test_a_recording_that_was_not_named_is_replaced_with_a_word(wrist):
    short = ("run", "--duration", 0.1, "--law", "pd")
    assert "replaces" not in wrist(*short)[1]
    assert re.search(r"replaces the wrist.rrd of (just now|\d+ seconds? ago)", wrist(*short)[1])
    assert json.loads(wrist(*short, "--json")[1])["replaced"] is True
    assert "replaces" not in wrist(*short, "-o", "wrist.rrd")[1]


# --- wrist list


def test_every_model_and_motion_of_the_package_is_listed_by_its_name(wrist):
    models = Path(__file__).parents[1] / "models"
    for kind, files in (("wrists", models.glob("*.xml")), ("motions", models.glob("*.csv"))):
        code, out, _ = wrist("list", kind, "--json")
        assert (code, set(json.loads(out))) == (0, {file.stem for file in files})
    assert "115 mm" in wrist("list", "wrist", "wrist")[1]


def test_bare_list_says_what_can_be_listed(wrist):
    code, out, _ = wrist("list")
    assert code == 0
    for kind in kinds().values():
        assert re.search(rf"^{kind.name} +{len(kind.entries())} ", out, re.MULTILINE)


@pytest.mark.parametrize("kind", kinds())
def test_a_kind_is_listed_with_every_name_and_each_thing_described(kind, wrist):
    entries = json.loads(wrist("list", kind, "--json")[1])
    code, out, _ = wrist("list", kind)
    assert code == 0
    assert entries
    for name, entry in entries.items():
        assert name in out
        assert entry["summary"]
    name = next(iter(entries))
    assert json.loads(wrist("list", kind, name, "--json")[1]) == {name: entries[name]}
    shown = wrist("list", kind, name)
    assert shown[0] == 0
    for other in kinds()[kind].others:
        assert wrist("list", other, name) == shown


def test_a_part_is_described_by_its_class(wrist):
    for part, family in PARTS.items():
        for name, member in family.members.items():
            told = json.loads(wrist("list", part, name, "--json")[1])[name]
            assert list(told["parameters"]) == list(member.model_fields)
            for parameter, info in told["parameters"].items():
                field = member.model_fields[parameter]
                assert (info["meaning"], info["unit"]) == (field.description, field.json_schema_extra["unit"])
            if issubclass(member, Law):
                assert told["status"] == member.status
                assert told["tracks_to"] == (member.tracks_to and member.tracks_to._asdict())


def test_the_paper_s_law_is_described_for_people(wrist):
    out = wrist("list", "fuzzy_sliding_computed_torque")[1]
    for word in ("paper", "law.K", "1/s", "source", "fuzzy_sliding_computed_torque.py", "wrist run --law"):
        assert word in out
    assert max(map(len, out.splitlines())) <= 80


# --- guides


@pytest.mark.parametrize("name", NAMES)
def test_code_in_a_guide_copies_whole_from_eighty_columns(name):
    """Each line of code is one line of the rendered guide, so that no break is copied with it."""
    text = read_guide(name).text
    page = StringIO()
    Console(width=80, file=page).print(Markdown(text))
    shown = page.getvalue().splitlines()
    blocks = re.findall(r"^```\w*\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.splitlines() if line.strip()]
    assert [line for line in lines if not any(line in each for each in shown)] == []
