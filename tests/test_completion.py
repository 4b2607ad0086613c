"""Completion in the shell: what bash offers, how it gets there, and that it is what the package really has."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from spherical_wrist import Experiment
from spherical_wrist.cli import completion
from spherical_wrist.cli.app import app
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.experiment.command import read_settings
from spherical_wrist.experiment.description import PARTS, with_changes
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.reference import Reference


def bash(tmp_path, *lines):
    """Return the words that bash offers for each command line, whose last word is the one to complete."""
    folder = tmp_path / ".bin"
    folder.mkdir()
    command = folder / "wrist"
    command.write_text(f"#!{sys.executable}\nfrom spherical_wrist.cli import main\nmain()\n")
    command.chmod(0o755)
    script = ['eval "$(wrist --show-completion)"', "complete -p wrist"]
    for words in lines:
        quoted = " ".join(f"'{word}'" for word in words)
        script += [f"COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; COMPREPLY=()"]
        script += [f"_wrist_completion wrist '{words[-1]}' '{words[-2]}'"]
        script += ['(IFS="|"; echo "${COMPREPLY[*]}")']
    where = f"{folder}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": where}
    done = subprocess.run(
        [shutil.which("bash") or "bash", "--norc", "-c", "\n".join(script)],
        env=environment,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    first, *offers = done.stdout.splitlines()
    assert first == "complete -o default -F _wrist_completion wrist"
    return [offer.split("|") if offer else [] for offer in offers]


@pytest.fixture
def recordings(tmp_path):
    """A folder with recordings and other things."""
    (tmp_path / "one.rrd").touch()
    (tmp_path / "two.rrd").touch()
    (tmp_path / "notes.txt").touch()
    (tmp_path / "older").mkdir()


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_offers_values(tmp_path, recordings):
    lines = [
        (["wrist", ""], None),
        (["wrist", "run", "--law", "sup"], {"super_twisting"}),
        (["wrist", "run", "--law", "pd", "--set", "law."], {"law.P=[0.16,0.16,0.06]", "law.D=[0.016,0.016,0.006]"}),
        (["wrist", "view", ""], {"one.rrd", "two.rrd", "older/"}),
        (["wrist", "view", "old"], set()),  # bash itself goes on with the only folder
    ]
    offers = bash(tmp_path, *(words for words, _ in lines))
    assert {"run", "view", "list", "inspect"} <= set(offers[0])
    for (words, expected), offer in zip(lines[1:], offers[1:], strict=True):
        assert set(offer) == expected, words


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("run --law ", set(Law.members)),
        ("compare --law slo", {"slotine_li"}),
        ("run --reference ", set(Reference.members)),
        ("run --disturbance-shape ", set(Disturbance.members)),
        ("run --hardware ", set(HARDWARE)),
        ("run --set pay", {"payload=0"}),
        ("inspect o", {"one.rrd", "older/"}),
    ],
)
def test_the_command_offers_values_as_bash_asks_for_them(tmp_path, recordings, monkeypatch, capsys, words, expected):
    """In its environment, without an argument; what bash makes of the answer is tried above."""
    asked = {"COMP_WORDS": f"wrist {words}", "COMP_CWORD": str(words.count(" ") + 1)}
    for name, value in {**asked, "_WRIST_COMPLETE": "complete_bash"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        app(prog_name="wrist", standalone_mode=False)
    said = capsys.readouterr()
    assert (end.value.code or 0, set(said.out.splitlines()), said.err) == (0, expected, "")


def test_completing_imports_nothing_heavy(tmp_path):
    code = (
        "import atexit, sys; sys.argv = ['wrist']\n"
        "from spherical_wrist.cli import main\n"
        "try:\n    main()\n"
        "finally:\n    heavy = {'numba', 'mujoco', 'rerun', 'matplotlib'} & set(sys.modules)\n"
        "    assert not heavy, heavy"
    )
    asked = {"COMP_WORDS": "wrist run --set ", "COMP_CWORD": "3", "_WRIST_COMPLETE": "complete_bash"}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env={**os.environ, **asked}, capture_output=True, text=True, check=True)
    assert "mass_scale=1.25" in done.stdout.splitlines()
    assert "Error" not in done.stderr


@pytest.mark.parametrize("part", PARTS)
def test_members_are_offered_with_what_they_are(part):
    offers = dict(completion.members(part)(""))
    assert set(offers) == set(PARTS[part].members)
    assert all(offers.values())


class Context:
    """State of the words of the shell so far."""

    def __init__(self, **params):
        self.params = params


@pytest.mark.parametrize("law", Law.members)
def test_the_offered_settings_are_the_defaults_ready_to_be_changed(law):
    """Given as they stand, they change nothing."""
    offers = [name for name, _ in completion.settings(Context(law=law), "")]
    given = read_settings(offer for offer in offers if not offer.endswith("="))
    assert f"law.{next(iter(Law.members[law].model_fields))}" in {offer.partition("=")[0] for offer in offers}
    assert Experiment(**with_changes({}, {"law": law} | given)) == Experiment(law=law)


@pytest.mark.parametrize("name", HARDWARE)
def test_the_offered_settings_are_those_of_the_hardware(name):
    offers = [offer for offer, _ in completion.settings(Context(hardware=name), "")]
    given = read_settings(offer for offer in offers if offer.startswith(("sensing.", "actuation.")))
    usual = Experiment(**HARDWARE[name])
    assert {f"actuation.{field}" for field in type(usual.actuation).model_fields} <= set(given)
    assert Experiment(**with_changes(dict(HARDWARE[name]), given)) == usual


@pytest.mark.parametrize("typed", ["\0", "no/such/", "~", "[", "**", "/proc/1/root/"])
def test_nothing_that_is_typed_is_an_error(typed):
    assert completion.recordings(typed) == []
    assert completion.laws(typed) == []


def test_hidden_files_are_offered_to_those_who_ask(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in (".hidden.rrd", "seen.rrd"):
        Path(name).touch()
    assert completion.recordings("") == ["seen.rrd"]
    assert completion.recordings(".h") == [".hidden.rrd"]
