"""Inputs that are no files, that are the output, or that have numbers no computer needs: one line each, and no wait."""

import json
import os
import shutil
import signal
from contextlib import contextmanager
from pathlib import Path

import pytest

from rigs import one_line
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.files import read_whole
from spherical_wrist.wrist.mjcf import default_model

CAMPAIGN = """
laws = ["pd"]
samples = 4
batch = 2
[experiment]
duration = 0.05
[vary]
mass_scale = { uniform = [0.5, 1.5] }
"""
RUN = ("run", "--duration", "0.05")
MODEL = """<mujoco>%s<worldbody><body><joint name="wrist" type="ball"/><geom size=".1"/></body></worldbody></mujoco>"""
NINES, HEXADECIMAL = "9" * 5000, "0x" + "f" * 5000
"""Python does not read the first, which has more than 4300 digits, and does not print the second."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A recording and the folder of a campaign."""
    return tmp_path_factory.mktemp("inputs")


@pytest.fixture
def here(made, wrist, tmp_path):
    """An empty folder with copies of them, in which the command runs."""
    if not (made / "a.rrd").exists():
        (made / "c.toml").write_text(CAMPAIGN)
        assert wrist(*RUN, "-o", made / "a.rrd")[0] == 0
        assert wrist("sweep", made / "c.toml", "-o", made / "campaign", "--workers", "0")[0] == 0
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path


@contextmanager
def soon(seconds=60):
    """Fail where something waits."""

    def late(*_):
        raise TimeoutError("it waits")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def refused(wrist, *arguments):
    code, _, err = wrist(*arguments)
    assert code == 2, (arguments, err)
    assert err.count("\n") == 1, err
    assert len(err) < 600, err
    return err


READERS = (
    "run IT.toml",
    "run --law IT.py:Mine",
    "run --model IT.xml",
    "run --model includes.xml",
    "run --model mesh.xml",
    "run --reference recorded --set reference.file=IT.csv",
    "inspect IT.rrd",
    "diff a.rrd IT.rrd",
    "replay IT.rrd",
    "render IT.rrd",
    "view IT.rrd",
    "sweep IT.toml",
    "report IT.toml",
    "compare --law IT.py:Mine -o out",
)


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_a_pipe_or_a_folder_in_place_of_a_file_that_is_read(wrist, here, make):
    for suffix in ("toml", "py", "xml", "csv", "rrd", "stl"):
        make(here / f"IT.{suffix}")
    (here / "includes.xml").write_text(MODEL % "<include file='IT.xml'/>")
    (here / "mesh.xml").write_text(MODEL % "<asset><mesh name='m' file='IT.stl'/></asset>")
    for command in READERS:
        if (command, make) != ("sweep IT.toml", os.mkdir):  # which is then a folder without a campaign
            with soon():
                assert "IT" in refused(wrist, *command.split()), command


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_a_pipe_or_a_folder_in_the_folder_of_a_campaign(wrist, here, make):
    folder = here / "campaign"
    batch = sorted((folder / "episodes").iterdir())[0]
    batch.unlink()
    make(batch)
    for command in (("sweep", folder), ("report", folder), ("sweep", folder, "--replay", "0", "-o", "b.rrd")):
        with soon():
            code, _, err = wrist(*command)
        assert code == 0, err
        assert err == f"wrist: warning: not trusted: {batch.name}: not a file\n"
    with soon():
        assert wrist("sweep", folder, "--resume", "--workers", "0")[0] == 2  # it cannot put a file there
    (folder / "campaign.json").unlink()
    make(folder / "campaign.json")
    for command in (("sweep", folder), ("report", folder), ("sweep", folder, "--replay", "0")):
        with soon():
            assert "campaign.json" in refused(wrist, *command)


def test_a_pipe_that_somebody_writes_to_is_read(tmp_path):
    """As the ``<(command)`` of a shell."""
    read, write = os.pipe()
    os.write(write, b"duration = 1")
    os.close(write)
    assert read_whole(Path(f"/proc/self/fd/{read}")) == b"duration = 1"
    os.close(read)
    with pytest.raises(OSError, match="a device"):
        read_whole(Path("/dev/zero"))


ONTO_INPUTS = (
    "run e.toml -o e.toml",
    "run -o mine.py --law mine.py:Mine",
    "run --model m.xml -o m.xml",
    "run --reference recorded --set reference.file=motion.csv -o motion.csv",
    "run e.toml -o link.rrd",
    "inspect a.rrd --export hard.csv",
    "inspect a.png --plot a.png",
    "diff a.rrd a.png --plot a.png",
    "render a.gif -o a.gif",
    "render a.png --frame a.png",
    "view a.png --screenshot a.png",
    "sweep c.toml -o c.toml",
    "sweep campaign --replay 0 -o campaign/campaign.json",
    "sweep campaign --replay 0 -o campaign/episodes/000000000002-000000000004.parquet",
    "sweep campaign --replay 0 -o campaign/episodes/new.rrd",
    "report campaign -o campaign/campaign.toml",
)


def test_no_command_writes_onto_its_input(wrist, here):
    (here / "e.toml").write_text("duration = 0.05")
    (here / "link.rrd").symlink_to("e.toml")
    (here / "mine.py").write_text(
        "from spherical_wrist.control import Law\n\n\nclass Mine(Law):\n    @staticmethod\n"
        "    def step(signal, parameters, state, command):\n        command.torque[0] = 0.0\n"
    )
    shutil.copy(default_model(), here / "m.xml")
    (here / "motion.csv").write_text("time,qw,qx,qy,qz\n" + "".join(f"{i / 100},1,0,0,0\n" for i in range(20)))
    for copy in ("a.png", "a.gif"):
        shutil.copy(here / "a.rrd", here / copy)
    os.link(here / "a.rrd", here / "hard.csv")
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    for command in ONTO_INPUTS:
        err = refused(wrist, *command.split())
        assert "input" in err or "give" in err, err
        assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file() and path in before} == before
        assert not (here / "campaign" / "episodes" / "new.rrd").exists()


HUGE = (
    *(f"run --set {name}={value}" for name in ("seed", "mass_scale", "law.Kp", "reference.amplitude")
      for value in (NINES, HEXADECIMAL, "9" * 400)),
    *(f"run {option} {NINES}" for option in ("--seed", "--duration", "--record-every", "--mass-scale")),
    f"sweep campaign --replay {NINES}",
    f"sweep c.toml --workers {NINES}",
    f"report campaign --bound {NINES}",
)  # fmt: skip


def test_integers_of_thousands_of_digits(wrist, here):
    for command in HUGE:
        refused(wrist, *command.split(), *(["--no-recording"] if command.startswith("run") else []))
    for text in (f"seed = {NINES}", f"seed = {HEXADECIMAL}", f"[law]\nname = 'pd'\nKp = [1, {HEXADECIMAL}, 1]"):
        (here / "e.toml").write_text(text)
        refused(wrist, "run", "e.toml", "--no-recording")
    for text in (f"samples = {NINES}", CAMPAIGN.replace("0.5", NINES), CAMPAIGN.replace("1.5", HEXADECIMAL)):
        (here / "d.toml").write_text(text)
        refused(wrist, "sweep", "d.toml")
    with pytest.raises(ParameterError) as error:
        Experiment(mass_scale=int(HEXADECIMAL, 0))
    one_line(error.value)


BROKEN = (
    "", "{", "[]", "null", "\0", "[" * 100_000, NINES,
    '{"format": 1}', '{"format": 1, "campaign": []}', '{"format": true}',
)  # fmt: skip
JUNK = (None, True, -1, 0, 1.5, "x", "", [], {}, [1], {"a": 1}, 10**30, 10**400)


def test_a_broken_description_of_a_campaign_is_one_line(wrist, here):
    file = here / "campaign" / "campaign.json"
    whole = json.loads(file.read_text())
    for text in BROKEN:
        file.write_text(text)
        for command in (("sweep", "campaign"), ("report", "campaign")):
            assert "campaign.json" in refused(wrist, *command), text[:50]
    opened = 0
    for key in whole.keys() | {f"campaign.{name}" for name in whole["campaign"]}:
        for junk in JUNK:
            damaged = json.loads(json.dumps(whole))
            within = damaged["campaign"] if "." in key else damaged
            within[key.rpartition(".")[2]] = junk
            file.write_text(json.dumps(damaged))
            try:
                folder = Folder.open(here / "campaign")
            except (CampaignError, ParameterError) as error:
                one_line(error)
            else:
                opened += 1
                folder.files.scan()
    assert opened < 40
