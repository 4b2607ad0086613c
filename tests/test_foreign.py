"""Recordings and campaign folders of other people: nothing in them runs unasked, and nothing beside them is opened.

The files are made with the package's own writers, as someone would who knows them well. Python's audit events tell
which files are opened; MuJoCo opens files without telling Python, so the secret ones are such that what it reads
would show.
"""

import json
import os
import py_compile
import shutil
import sys

import pytest

import needs
from rigs import mjcf, one_line
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.campaign.folder import RESOLVED, Folder
from spherical_wrist.consent import without_code
from spherical_wrist.errors import RecordingError, WristError
from spherical_wrist.experiment.description import PARTS
from spherical_wrist.experiment.embedded_files import EmbeddedFiles
from spherical_wrist.inspection.replay import replay
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.recording.writer import write_recording
from spherical_wrist.wrist import check_confined

EVIL = """
from pathlib import Path
Path({ran!r}).write_text("ran")
from spherical_wrist.control import Law

class Evil(Law):
    stiffness: float = 0.2

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = parameters.stiffness * signal.error[i] + 0.02 * signal.rate_error[i]
"""
OPENED = []
"""Paths opened in this process while a test watches."""
_watching = []


@sys.addaudithook
def _listen(event, arguments):
    if _watching and event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
        OPENED.append(os.fspath(arguments[0]))


@pytest.fixture
def ran(tmp_path):
    """The file that hostile code writes."""
    return tmp_path / "ran"


@pytest.fixture
def evil(tmp_path, ran):
    """A hostile law, also as bytecode, in a folder of its own."""
    folder = tmp_path / "evil"
    folder.mkdir()
    (folder / "evil.py").write_text(EVIL.format(ran=str(ran)))
    py_compile.compile(str(folder / "evil.py"), str(folder / "evil.pyc"), doraise=True)
    return folder / "evil.py"


@pytest.fixture(scope="module")
def honest():
    return simulate(Experiment(duration=0.05, law="pd"))


def forged(path, run, changes=None, files=None):
    """Write a recording of a run, with other properties: changes of its experiment, and files by place in the archive.

    Files are pairs of path and content; None leaves out the one that the run carries.
    """
    carried = EmbeddedFiles(dict(run.embedded_files.places), dict(run.embedded_files.files))
    for name, file in (files or {}).items():
        if file is None:
            del carried.places[name]
        else:
            carried.places[name], carried.files[file[0]] = file
    properties = properties_of(run)
    properties["experiment"] |= changes or {}
    properties["files"] = {name: {"path": place, "sha256": ""} for name, place in carried.places.items()}
    write_recording(path, run, plant_of(Experiment(duration=0.05)), properties, 1, carried.archive())
    return path


CODE = {
    "carried": lambda evil: ({"law": {"name": f"{evil}:Evil"}}, {"law": ("law/evil.py", evil.read_bytes())}),
    "on this disk": lambda evil: ({"law": {"name": f"{evil}:Evil"}}, {}),
    "beside the recording": lambda evil: ({"law": {"name": "evil.py:Evil"}}, {}),
    "as bytecode": lambda evil: (
        {"law": {"name": f"{evil}:Evil"}},
        {"law": ("law/a.py:/x.pyc", evil.with_suffix(".pyc").read_bytes())},
    ),
    "without a table": lambda evil: ({"law": f"{evil}:Evil"}, {}),
    "as a motion": lambda evil: (
        {"reference": {"name": f"{evil}:Evil"}},
        {"reference": ("reference/evil.py", evil.read_bytes())},
    ),
    "as sensors": lambda evil: ({"sensing": {"name": f"{evil}:Evil"}}, {}),
    "without a model": lambda evil: ({"law": {"name": f"{evil}:Evil"}}, {"model": None}),
    "with a model on this disk": lambda evil: (
        {"law": {"name": f"{evil}:Evil"}, "model": str(evil.with_name("evil.xml"))},
        {"model": None},
    ),
}
"""Changes of the experiment and files of a recording that would run code, by how they name it."""
COMMANDS = ("replay", "inspect", "inspect --plot a.png --export a.csv", "diff", "render --frame a.png --size 320x240")


@pytest.mark.parametrize("way", CODE)
def test_no_command_runs_code_unasked(wrist, evil, ran, honest, tmp_path, way):
    shutil.copy(evil, tmp_path)
    path = forged(tmp_path / "foreign.rrd", honest, *CODE[way](evil))
    for command in COMMANDS:
        if "render" in command:
            needs.opengl()
        name, *options = command.split()
        code, _, err = wrist(name, path, *([path] if name == "diff" else []), *options)
        assert not ran.exists(), command
        assert code in (0, 2), err
        assert err.count("\n") == (code == 2), err
        if name == "replay":
            assert code == 2
    with pytest.raises(WristError):
        assert load_recording(path).experiment
    assert not ran.exists()


@pytest.mark.parametrize("way", [way for way in CODE if way not in ("carried", "as a motion")])
def test_consent_is_to_the_code_in_the_recording_and_to_no_other(wrist, evil, ran, honest, tmp_path, way):
    shutil.copy(evil, tmp_path)
    path = forged(tmp_path / "foreign.rrd", honest, *CODE[way](evil))
    code, _, err = wrist("replay", path, "--trust")
    assert code == 2
    assert err.count("\n") == 1
    with pytest.raises(WristError):
        assert load_recording(path, trust=True).experiment
    assert not ran.exists()


def test_with_consent_the_code_in_the_recording_runs(wrist, evil, ran, honest, tmp_path):
    path = forged(tmp_path / "foreign.rrd", honest, *CODE["carried"](evil))
    assert wrist("replay", path, "--trust")[0] == 1  # another law than that of the run
    assert ran.exists()
    assert load_recording(path, trust=True).experiment.law.name == "evil"


FILES = {
    "a motion on this disk": lambda secret: ({"reference": {"name": "recorded", "file": str(secret)}}, {}),
    "a motion in a short form": lambda secret: ({"reference": {"name": f"recorded:{secret}"}}, {}),
    "a motion in a text": lambda secret: ({"reference": f"recorded:{secret}"}, {}),
    "a motion beside": lambda secret: ({"reference": {"name": "recorded", "file": secret.name}}, {}),
    "the times of a motion": lambda secret: ({"reference": {"name": "recorded", "times": str(secret)}}, {}),
    "a number that is a file": lambda secret: ({}, {"law.P": ("law/p", b"1")}),
    "a part that there is not": lambda secret: ({}, {"nothing": ("nothing/p", b"1")}),
    "a model on this disk": lambda secret: ({"model": str(secret)}, {"model": None}),
}


@pytest.mark.parametrize("kind", FILES)
def test_nothing_is_opened_that_is_not_in_the_recording(wrist, honest, tmp_path, kind):
    secret = tmp_path / "secret.csv"
    secret.write_text("t,w,x,y,z\n0,1,0,0,0\n1,1,0,0,0\n")
    path = forged(tmp_path / "foreign.rrd", honest, *FILES[kind](secret))
    OPENED.clear()
    _watching.append(True)
    try:
        code, _, err = wrist("replay", path, "--trust")
        for command in ("inspect", "render --frame a.png --size 320x240"):
            wrist(command.split()[0], path, *command.split()[1:])
    finally:
        _watching.clear()
    assert (code, err.count("\n")) == (2, 1), err
    assert OPENED
    assert not [file for file in map(os.fsdecode, OPENED) if "secret" in file]


OUTSIDE = {
    "include": '<include file="{file}"/>',
    "mesh": '<asset><mesh name="m" file="{file}"/></asset>',
    "texture": '<asset><texture name="t" type="2d" file="{file}"/></asset>',
    "cube": '<asset><texture name="t" type="cube" fileright="{file}"/></asset>',
    "height field": '<asset><hfield name="h" file="{file}" size="1 1 1 1"/></asset>',
    "skin": '<asset><skin name="s" file="{file}"/></asset>',
    "model": '<asset><model name="m" file="{file}"/></asset>',
    "folder of meshes": '<compiler meshdir="{folder}"/><asset><mesh name="m" file="{name}"/></asset>',
    "folder of assets": '<compiler assetdir="{folder}"/><asset><texture name="t" file="{name}"/></asset>',
    "flexible body": '<worldbody><flexcomp name="f" type="mesh" file="{file}"/></worldbody>',
}
"""Parts of a model that open a file, by kind."""


@pytest.mark.parametrize("climbing", [False, True], ids=["absolute", "climbing"])
@pytest.mark.parametrize("kind", OUTSIDE)
def test_a_model_opens_nothing_outside_of_the_recording(wrist, honest, tmp_path, kind, climbing):
    secret = tmp_path / "secret.obj"
    secret.write_text("v 0 0 0")
    up = "../" * 40 if climbing else "/"
    file = f"{up}{str(secret)[1:]}"
    names = {"file": file, "folder": file.rpartition("/")[0], "name": secret.name}
    text = mjcf(more=OUTSIDE[kind].format(**names))
    path = forged(tmp_path / "foreign.rrd", honest, {}, {"model": ("model/a.xml", text.encode())})
    for command in ("replay --trust", "render --frame a.png --size 320x240"):
        name, *options = command.split()
        code, _, err = wrist(name, path, *options)
        assert (code, err.count("\n")) == (2, 1), err
        assert "outside of what it came with" in err
    assert wrist("inspect", path)[0] == 0


def test_an_included_file_opens_nothing_outside_either(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "main.xml").write_text(mjcf(more='<include file="parts/a.xml"/>'))
    (tmp_path / "in" / "parts").mkdir()
    inner = tmp_path / "in" / "parts" / "a.xml"
    inner.write_text('<mujoco><asset><mesh name="m" file="../../secret.obj"/></asset></mujoco>')
    with pytest.raises(WristError, match=r"secret\.obj.*outside"):
        check_confined(tmp_path / "in" / "main.xml", tmp_path / "in")
    inner.write_text('<mujoco><asset><mesh name="m" file="m.obj"/></asset></mujoco>')
    check_confined(tmp_path / "in" / "main.xml", tmp_path / "in")


@pytest.mark.parametrize(
    "text",
    [
        r'<mujoco><asset><mesh name="m" file="..\secret.obj"/></asset></mujoco>',
        r'<mujoco><compiler meshdir="..\"/><asset><mesh name="m" file="secret.obj"/></asset></mujoco>',
        '<!DOCTYPE m [<!ENTITY e "a/b">]><mujoco><asset><mesh name="m" file="&e;/../../secret.obj"/></asset></mujoco>',
        '<!DOCTYPE m [<!-- > <mujoco><asset><mesh name="m" file="../secret.obj"/></asset></mujoco> --> ]><mujoco/>',
        '<!DOCTYPE m SYSTEM "><mujoco><asset><mesh name=%s file=%s/></asset></mujoco>"><mujoco/>',
        '<mujoco><INCLUDE file="b.xml"/></mujoco>',
        '<mujoco><asset><model name="m" file="b.xml"/></asset></mujoco>',
        '<mujoco><asset><model name="m" file="a.xml"/><model name="n" file="b.xml"/></asset></mujoco>',
    ],
)
def test_names_that_mujoco_reads_otherwise_than_xml_or_the_system_are_confined_too(tmp_path, text):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.xml").write_text(text)
    (tmp_path / "in" / "b.xml").write_text('<mujoco><include file="../secret.xml"/></mujoco>')
    with pytest.raises(WristError) as error:
        check_confined(tmp_path / "in" / "a.xml", tmp_path / "in")
    assert any(word in one_line(error.value) for word in ("outside", "entities", "document type"))


@pytest.mark.parametrize("command", ["replay", "render"])
def test_a_model_that_grows_without_end_is_one_line(wrist, honest, tmp_path, command):
    bomb = mjcf(more='<worldbody><replicate count="100000000"><geom size="1"/></replicate></worldbody>')
    path = forged(tmp_path / "foreign.rrd", honest, {}, {"model": ("model/a.xml", bomb.encode())})
    code, _, err = wrist(command, path)
    assert (code, err.count("\n")) == (2, 1), err
    assert " elements: make it 100,000 or less" in err


@pytest.mark.parametrize(
    "text", ["", "<mujoco", "\0", "<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/hosts'>]><a>&b;</a>"]
)
def test_a_model_that_is_no_xml_is_one_line(wrist, honest, tmp_path, text):
    path = forged(tmp_path / "foreign.rrd", honest, {}, {"model": ("model/a.xml", text.encode())})
    code, _, err = wrist("replay", path)
    assert (code, err.count("\n")) == (2, 1), err


# --- campaigns


CAMPAIGN = """
laws = ["{law}"]
samples = 4
batch = 2
[experiment]
duration = 0.05
[vary]
mass_scale = {{ uniform = [0.5, 1.5] }}
"law.stiffness" = {{ uniform = [0.1, 0.2] }}
"""


@pytest.fixture
def campaign(wrist, evil, ran, tmp_path):
    """A finished campaign with a law of its maker's, as it comes by mail: its law is code that would run here."""
    (tmp_path / "c.toml").write_text(CAMPAIGN.format(law=f"{evil}:Evil"))
    code, _, err = wrist("sweep", tmp_path / "c.toml", "-o", tmp_path / "c", "--workers", "0", "--threads", "1")
    assert code == 0, err
    ran.unlink()
    return (tmp_path / "c").rename(tmp_path / "mailed")  # a file in another place is loaded, and run, anew


def test_results_of_a_campaign_are_shown_without_its_code(wrist, campaign, ran):
    for command in (
        ["sweep", campaign],
        ["sweep", campaign, "--json"],
        ["report", campaign],
        ["report", campaign, "--json"],
    ):
        code, out, err = wrist(*command)
        assert (code, err) == (0, ""), command
        assert "--json" not in command or "Evil" in out
        assert not ran.exists(), command
    assert Folder.open(campaign).withheld


@pytest.mark.parametrize("options", [["--replay", "1"], ["--resume"]])
def test_a_campaign_runs_its_code_only_with_consent(wrist, campaign, ran, tmp_path, options):
    code, _, err = wrist("sweep", campaign, *options)
    assert (code, err.count("\n")) == (2, 1)
    assert "--trust" in err
    assert not ran.exists()
    assert wrist("sweep", campaign, *options, "--trust")[0] == 0
    assert ran.exists()


def test_a_campaign_file_is_consent_to_what_it_names(wrist, campaign, tmp_path):
    code, _, err = wrist("sweep", tmp_path / "c.toml", "-o", campaign, "--resume", "--workers", "0")
    assert (code, err) == (0, "")


def test_a_varied_part_that_is_code_is_withheld_too(wrist, campaign, evil, ran):
    file = campaign / RESOLVED
    described = json.loads(file.read_text())
    described["campaign"]["laws"] = {"pd": {"name": "pd"}}
    described["campaign"]["vary"] = {"reference.name": {"choice": ["lissajous", f"{evil}:Evil"]}}
    file.write_text(json.dumps(described))
    for command in (["sweep", campaign], ["report", campaign], ["sweep", campaign, "--replay", "1"]):
        _, _, err = wrist(*command)
        assert all(line.startswith("wrist: ") for line in err.splitlines())
        assert not ran.exists(), command
    assert Folder.open(campaign).withheld == (f"{evil}:Evil",)


# --- placeholders


@pytest.mark.parametrize("part", PARTS)
def test_a_placeholder_has_the_parameters_that_it_is_given(part, evil, ran):
    with without_code():
        experiment = Experiment(**{part: {"name": f"{evil}:Evil", "stiffness": 0.3}})
    member = getattr(experiment, part)
    assert experiment.model_dump(mode="json")[part] == {**member.model_dump(mode="json"), "name": f"{evil}:Evil"}
    assert member.stiffness == 0.3
    assert not ran.exists()
    assert type(member) not in PARTS[part].members.values()


@pytest.mark.parametrize("name", ["step", "__init__", "model_config", "a b", "members"])
def test_a_placeholder_cannot_have_any_name(evil, name):
    with without_code(), pytest.raises(WristError) as error:
        Experiment(law={"name": f"{evil}:Evil", name: 1.0})
    one_line(error.value)


def test_an_honest_recording_replays_bit_for_bit(tmp_path, honest):
    record(honest, tmp_path / "run.rrd")
    assert replay(tmp_path / "run.rrd").identical
    assert load_recording(tmp_path / "run.rrd").experiment.law == honest.experiment.law


def test_files_on_the_way_to_a_recording_are_told(honest, tmp_path):
    """A recording of an older version without files and with a model of its own cannot be drawn."""
    path = forged(tmp_path / "foreign.rrd", honest, {"model": "/somewhere/model.xml"}, {"model": None})
    with pytest.raises(RecordingError, match="does not carry it"), load_recording(path).plant():
        pass
