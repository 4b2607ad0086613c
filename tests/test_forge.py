"""Hostile recordings and folders under every command: nothing runs, nothing else is opened, each ends with one line.

By default every attack meets one command, and every command some attack; with WRIST_THOROUGH=1 all meet all.
"""

import re
import shutil
import signal
import sys

import pytest

import forge
import needs
from forge import CAMPAIGN, HONEST, MADE, READING, RENDER, Attack, Forge, Place, opened
from sampling import THOROUGH
from spherical_wrist import Experiment, simulate
from spherical_wrist.campaign.cluster import Cluster
from spherical_wrist.campaign.folder import Folder, campaign_lock
from spherical_wrist.campaign.sweep import Listener, read_campaign, sweep
from spherical_wrist.cli.app import COMMANDS

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="opened files are watched by Linux")

SOON = 120
"""Time [s] that no command may take."""
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Characters that a terminal obeys."""


@pytest.fixture(scope="module")
def honest():
    """The recordings that are forged are of this run."""
    return Forge.of(simulate(Experiment(duration=0.05, law="pd")))


@pytest.fixture(scope="module")
def honest_folder(tmp_path_factory):
    """The folders that are forged are copies of this one."""
    room = tmp_path_factory.mktemp("honest")
    (room / "hand.xml").write_text(forge.mjcf())
    (room / "motion.csv").write_text("t,w,x,y,z\n" + "".join(f"{0.01 * k:g},1,0,0,0\n" for k in range(20)))
    text = HONEST.format(motion=room / "motion.csv").replace("hand.xml", str(room / "hand.xml"))
    (room / "c.toml").write_text(text)
    with campaign_lock(room / "c"):
        folder = Folder.create(room / "c", room / "c.toml", read_campaign(room / "c.toml"))
        sweep(folder, Cluster(workers=0, threads=1), Listener())
    return folder.path


def too_late(*_):
    raise AssertionError(f"it takes more than {SOON} s")


def check(wrist, command, attack, place, watched):
    """Run one command, and check what must be true of any."""
    needs.opengl() if command == RENDER and command not in attack.refused else None
    consent = attack.consent and "--trust" in command
    before = {path.name for path in place.folder.iterdir()}
    watched()
    signal.signal(signal.SIGALRM, too_late)
    signal.alarm(SOON)
    try:
        code, out, err = wrist(*command.replace("FILE", "a.rrd").replace("DIR", "c").split())
    finally:
        signal.alarm(0)
    seen = sorted(name for name in watched() if name.startswith(("evil", "secret")))
    lines = [line for line in err.splitlines() if not line.startswith("wrist: warning: ")]
    assert code in (0, 1, 2), (command, err)
    assert len(lines) == (code == 2), (command, err)
    assert all(line.startswith("wrist: error: ") and len(line) < 1500 for line in lines), (command, err)
    assert not OBEYED.search(out + err), (command, out, err)
    if not consent:
        assert not place.ran.exists(), command
        assert not seen, command
    place.ran.unlink(missing_ok=True)
    assert {path.name for path in place.folder.iterdir()} - before <= MADE
    if command in attack.refused:
        assert (code, attack.said in err) == (2, True), (command, err)


def commands_for(number: int, attack: Attack, commands: tuple[str, ...], attacks: int) -> tuple[str, ...]:
    """Return the commands that an attack meets: all, or one that refuses it, and each of the others once in all."""
    if THOROUGH:
        return commands
    stride = attacks // len(commands)
    also = commands[number // stride] if number % stride == 0 and number // stride < len(commands) else commands[0]
    return attack.refused[number % len(attack.refused) :][:1] if attack.refused and number % stride else (also,)


RECORDINGS = list(forge.recordings(None))
FOLDERS = list(forge.folders(None))


@pytest.mark.parametrize("name", RECORDINGS)
def test_a_hostile_recording(wrist, honest, tmp_path, name):
    place, attack = Place.at(tmp_path), forge.recordings(honest)[name]
    attack.make(tmp_path / "a.rrd", place)
    with opened(tmp_path, place.evil.parent) as watched:
        for command in commands_for(RECORDINGS.index(name), attack, READING, len(RECORDINGS)):
            check(wrist, command, attack, place, watched)


@pytest.mark.parametrize("name", FOLDERS)
def test_a_hostile_folder(wrist, honest_folder, tmp_path, name):
    place, attack = Place.at(tmp_path), forge.folders(honest_folder)[name]
    attack.make(tmp_path / "c", place)
    with opened(tmp_path, place.evil.parent) as watched:
        for command in commands_for(FOLDERS.index(name), attack, CAMPAIGN, len(FOLDERS)):
            check(wrist, command, attack, place, watched)


def test_the_watch_sees_what_mujoco_and_python_open(tmp_path):
    import mujoco

    (tmp_path / "secret.xml").write_text(forge.mjcf())
    with opened(tmp_path) as watched:
        assert watched() == set()
        mujoco.MjModel.from_xml_path(str(tmp_path / "secret.xml"))
        assert watched() == {"secret.xml"}
        assert watched() == set()


def test_what_is_honest_is_read_by_every_command(wrist, honest, honest_folder, tmp_path):
    """So that what refuses an attack is the attack."""
    honest.write(tmp_path / "a.rrd")
    shutil.copytree(honest_folder, tmp_path / "c")
    for command in (*READING, *CAMPAIGN) if THOROUGH else (forge.REPLAY, *forge.BOTH):
        assert wrist(*command.replace("FILE", "a.rrd").replace("DIR", "c").split())[0] == 0, command


def test_every_command_that_reads_a_recording_or_a_folder_is_here():
    """All commands but those that make something new, and ``view``, of which Rerun's viewer reads the recording."""
    tried = {command.split()[0] for command in (*READING, *CAMPAIGN)} - {"FILE", "DIR"}
    new = {"ablate", "compare", "design", "frontier", "margins", "paper", "run", "tune"}
    assert set(COMMANDS) - tried - new == {"guide", "list", "view"}, COMMANDS.keys()
