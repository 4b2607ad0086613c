"""Full disks and read-only folders: every command that writes says so in one line, and leaves what was there.

A disk is a small tmpfs, which only root can mount; elsewhere these tests are skipped. A new command that writes is one
more line of COMMANDS. By default each command meets one of three full disks; with WRIST_THOROUGH=1, all.
"""

import gc
import os
import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from functools import cache

import pytest
from matplotlib.figure import Figure
from typer.main import get_command

import needs
from sampling import THOROUGH, some
from sketches import sketched
from spherical_wrist.cli import main
from spherical_wrist.cli.app import app
from spherical_wrist.paper.evaluation import report
from spherical_wrist.recording.seal import check_seal

COMMANDS = {
    "run": "run --duration 0.5 -o out/a.rrd",
    "compare": "compare --law pd --case realistic --duration 0.3 --record all -o out --plot out/a.pdf "
    "--table out/a.tex",
    "frontier": "frontier --law pd --axis heavier --tolerance 0.3 --set duration=0.3 -o out --plot out/a.png "
    "--table out/a.md",
    "margins": "margins --law pd --no-ranges -o out --plot out/a.png --table out/a.csv",
    "plot": "plot run.rrd -o out/a.png",
    "design": "design pd --trials 1 -o out/found.json",
    "paper": "paper -o out",
    "sweep": "sweep campaign.toml -o out/c --workers 0 --threads 1",
    "report": "report campaign -o out/page.html",
    "replay": "sweep campaign --replay 0 -o out/a.rrd",
    "inspect": "inspect run.rrd --plot out/a.png --plot out/a.svg --export out/a.csv --export out/a.parquet",
    "diff": "diff run.rrd run.rrd --plot out/a.png",
    "extract": "replay run.rrd --extract out",
    "film": "render run.rrd -o out/a.gif --size 160x120 --fps 5",
    "picture": "render run.rrd --frame out/a.png --size 320x240",
    "screenshot": "view run.rrd --screenshot out/a.png --size 400x300",
    "ablate": "ablate fuzzy_observer_sliding --duration 0.3 -o out --plot out/a.png --table out/a.md",
    "tune": "tune pd --trials 3 --case constant-heavy --duration 0.3 -o out --plot out/a.png",
}
"""Command lines of ``wrist``; ``out`` is the disk. Searching gains takes longest: it is tried with WRIST_THOROUGH=1."""
WRITING = {"--output", "--plot", "--table", "--export", "--extract", "--frame", "--screenshot"}
"""Options that name what is written."""
GOES_ON = {"sweep": "--resume", "tune": ""}
"""Commands that keep what is finished, and what makes the same command go on with it."""
ROOMY, PAGE = 64 << 20, 4096
CAMPAIGN = """
laws = ["pd"]
samples = 8
batch = 2
[experiment]
duration = 0.1
[vary]
mass_scale = { uniform = [0.5, 1.5] }
"""


evaluated = cache(report.evaluate)
"""The runs of ``wrist paper``, done once; these tests are about its writing."""


class Disk:
    """A tmpfs, mounted."""

    def __init__(self, path):
        self.path = path

    def mount(self, *options):
        subprocess.run(["mount", "-t", "tmpfs", "-o", ",".join(options), "tmpfs", self.path], check=True)

    def leave(self, free):
        """Leaves so many bytes on it."""
        found = os.statvfs(self.path)
        used = (found.f_blocks - found.f_bfree) * found.f_frsize
        self.mount("remount", "rw", f"size={max(used + free, PAGE)}")

    def files(self):
        return {
            str(path.relative_to(self.path)): path.read_bytes()
            for path in sorted(self.path.rglob("*"))
            if path.is_file() and path.name != ".lock"
        }

    def empty(self):
        self.mount("remount", "rw", f"size={ROOMY}")
        for path in self.path.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        (self.path / "ballast").write_bytes(bytes(PAGE))


@contextmanager
def mounted(path):
    path.mkdir()
    disk = Disk(path)
    try:
        disk.mount(f"size={ROOMY}")
    except (OSError, subprocess.CalledProcessError) as error:
        if "CI" in os.environ and os.getuid() == 0:
            raise
        pytest.skip(f"mounting a tmpfs needs root: {error}")
    try:
        yield disk
    finally:
        subprocess.run(["umount", "--lazy", path], check=True)


@pytest.fixture
def wrist(capfd, monkeypatch, tmp_path):
    """Runs the command here; gives its exit code and what it said."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(report, "evaluate", evaluated)
    monkeypatch.setattr(Figure, "savefig", sketched)
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)

    def command(text):
        monkeypatch.setattr(sys, "argv", ["wrist", *text.split()])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code, capfd.readouterr().err

    return command


def test_every_command_that_writes_is_tried(monkeypatch, capfd):
    """Commands and their options are those of the help."""

    def options(*command):
        monkeypatch.setattr(sys, "argv", ["wrist", *command, "--help"])
        with pytest.raises(SystemExit):
            main()
        return set(re.findall(r"--\w+", capfd.readouterr().out))

    options()
    names = get_command(app).list_commands(None)
    assert len(names) > 10
    lines = [line.replace(" -o ", " --output ").split() for line in COMMANDS.values()]
    tried = {(command, word) for command, *rest in lines for word in rest}
    assert not [(name, option) for name in names for option in WRITING & options(name) if (name, option) not in tried]


@pytest.mark.slow
@pytest.mark.parametrize("name", some([name for name in COMMANDS if THOROUGH or name != "design"], 2))
def test_a_full_or_read_only_disk_is_one_line_and_leaves_what_was_there(wrist, tmp_path, name):
    command = COMMANDS[name]
    if name == "screenshot":
        needs.vulkan()
    if name in ("film", "picture"):
        needs.opengl()
    if " run.rrd " in command:
        assert wrist("run --duration 0.4 -o run.rrd") == (0, "")
    if " campaign " in command:
        assert wrist("sweep campaign.toml -o campaign --workers 0 --threads 1") == (0, "")
    with mounted(tmp_path / "out") as disk:
        disk.empty()
        assert wrist(command) == (0, "")
        whole, said = disk.files(), []
        need = sum(-(-len(content) // PAGE) * PAGE for content in whole.values())
        levels = (0, 2 * PAGE, max(need - 4 * PAGE, 0))
        for free in levels if THOROUGH else levels[list(COMMANDS).index(name) % 3 :][:1]:
            left = free
            code, err, before, after = tried(wrist, disk, name, left)
            while not code:  # what takes the place of old files one by one needs less
                left //= 2
                code, err, before, after = tried(wrist, disk, name, left)
            said.append(refusal(code, err))
            if name in GOES_ON:
                disk.leave(ROOMY)
                goes_on = GOES_ON[name] if any(each.endswith("campaign.json") for each in after) else ""
                assert wrist(f"{command} {goes_on}") == (0, "")
                assert disk.files().keys() == whole.keys()
            else:
                assert after.keys() == before.keys()
                for each in after:
                    if each.endswith(".rrd"):
                        check_seal(disk.path / each)
                    else:
                        assert after[each] == before[each]
        before = disk.files()
        gc.collect()  # whose files are still open, after an error, would keep the disk busy
        disk.mount("remount", "ro")
        said.append(refusal(*wrist(f"{command} {GOES_ON.get(name, '')}")))
        assert disk.files() == before
    print(*said, sep="")


def tried(wrist, disk, name, free):
    """A command with so many bytes left: exit code, what it said, the files before and after."""
    if name in GOES_ON:
        disk.empty()
    before = disk.files()
    disk.leave(free)
    return *wrist(COMMANDS[name]), before, disk.files()


def refusal(code, err):
    assert code == 2, err
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1
    assert any(text in err for text in ("No space left on device", "disk is full", "Read-only file system"))
    return err
