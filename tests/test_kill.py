"""``wrist run`` killed at any moment of its life: its file is whole, or not there; and stopped, it keeps what it has.

Moments are seeded: a phase of its life (starting, simulating, recording, writing, naming the file and ending) and a
fraction of the time that this phase takes in an undisturbed run, as measured here.
"""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from sampling import count
from spherical_wrist.errors import WristError
from spherical_wrist.inspection import inspect

AT_A_TIME = 2
MARKS = """
import os, sys
to, phases = int(sys.argv.pop(1)), ["start"]
def listen(event, args):
    if event == "ctypes.dlsym" and args[1] == "mjcb_time":
        phase = "simulate"
    elif event == "import" and args[0] == "spherical_wrist.recording.runs":
        phase = "record"
    elif event == "open" and phases[-1] == "record" and args[2] & os.O_TMPFILE == os.O_TMPFILE:
        phase = "write"
    elif event in ("os.link", "os.rename") and phases[-1] == "write":
        phase = "name"
    else:
        return
    if phase not in phases:
        phases.append(phase)
        os.write(to, f"{phase}\\n".encode())
os.write(to, b"start\\n")
sys.addaudithook(listen)
from spherical_wrist.cli import main
main()
"""
"""The command, which tells through a pipe what it is about to do: Python's own audit events say so."""
PHASES = ("start", "simulate", "record", "write", "name")
"""Importing and compiling; simulating; making the recording; writing a file without a name; naming it, and the end."""
KILLS = count(3 * len(PHASES), 10 * len(PHASES))
STOPS = count(len(PHASES), 2 * len(PHASES))

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "O_TMPFILE"), reason="needs files without a name"),
]


class Life:
    """A run of the command into a folder, watched."""

    def __init__(self, folder, *options):
        read, write = os.pipe()
        command = [sys.executable, "-c", MARKS, str(write), "run", "-o", "a.rrd", *options]
        quiet = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        self.began, self.told, self.heard = time.monotonic(), os.fdopen(read), []
        self.process = subprocess.Popen(command, cwd=folder, pass_fds=[write], **quiet)
        os.close(write)

    def end(self):
        """Waits for its end: exit code, the last phase that it was in, and what it said."""
        _, err = self.process.communicate(timeout=60)
        with self.told:
            phases = [*self.heard, *self.told.read().split()]
        return self.process.returncode, phases[-1], err.decode()

    def wait_for(self, phase):
        """Waits until a phase begins."""
        while phase not in self.heard:
            self.heard.append(self.told.readline().strip())
            assert self.heard[-1], self.process.communicate()

    def phases(self):
        """Return the time at which each phase began, since the start [s]."""
        times = {line.strip(): time.monotonic() - self.began for line in self.told}
        self.told.close()
        self.process.communicate()
        assert self.process.returncode == 0
        return [*(times[phase] for phase in PHASES), time.monotonic() - self.began]


@pytest.fixture(scope="module")
def calendar(tmp_path_factory):
    """Return the times at which phases begin and the process ends: two at a time, the first run not counted."""
    folders = [tmp_path_factory.mktemp("life") for _ in range(AT_A_TIME)]
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        lives = list(pool.map(lambda folder: [Life(folder, *OPTIONS).phases() for _ in range(2)][1:], folders))
    return np.median(np.concatenate(lives), axis=0)


OPTIONS = ("--duration", "40", "--json")


def moments(calendar, seed, number):
    """Phases, as often each, and times since they began [s]."""
    phase = np.arange(number) % len(PHASES)
    return list(
        zip(phase, np.random.default_rng(seed).uniform(0.0, 1.0, number) * np.diff(calendar)[phase], strict=True)
    )


def struck(folder, number, moment):
    """Sends a signal to a run at a moment of its life."""
    life, (phase, later) = Life(folder, *OPTIONS), moment
    life.wait_for(PHASES[phase])
    time.sleep(later)
    life.process.send_signal(number)
    return life.end()


def in_pairs(work, items):
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        return list(pool.map(work, items))


def whole(file):
    """The number of rows of a recording, which must be in order."""
    return len(inspect(file).run)


@pytest.fixture(scope="module")
def old(tmp_path_factory):
    """A recording of another run, as bytes."""
    folder = tmp_path_factory.mktemp("old")
    assert Life(folder, "--duration", "0.5").end()[0] == 0
    return (folder / "a.rrd").read_bytes()


def test_killed_at_any_moment_the_file_is_whole_or_not_there(calendar, old, tmp_path):
    hit = Counter()

    def once(item):
        number, moment = item
        folder, before = tmp_path / str(number), number % 2 == 0
        folder.mkdir()
        if before:
            (folder / "a.rrd").write_bytes(old)
        code, phase, err = struck(folder, signal.SIGKILL, moment)
        assert code in (-signal.SIGKILL, 0), err
        assert {path.name for path in folder.iterdir()} <= {"a.rrd"}
        if before and (folder / "a.rrd").read_bytes() == old:
            assert code
        elif before or (folder / "a.rrd").exists():
            assert whole(folder / "a.rrd") == 40_000
            assert phase == "name"
        else:
            assert code
        return phase if code else "done"

    hit.update(in_pairs(once, enumerate(moments(calendar, 1, KILLS))))
    print(f"phases begin at {np.round(calendar, 3)} s; kills in them: {dict(hit)}")
    assert all(hit[phase] for phase in ("start", "simulate", "record"))
    assert hit["write"] + hit["name"]  # short, so that a busy machine decides which of them it is


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_stopped_at_any_moment_the_file_has_what_was_simulated_or_is_not_there(calendar, tmp_path, number):
    def once(item):
        index, moment = item
        folder = tmp_path / str(index)
        folder.mkdir()
        code, phase, err = struck(folder, number, moment)
        assert {path.name for path in folder.iterdir()} <= {"a.rrd"}
        assert "Traceback" not in err, err
        try:
            rows = whole(folder / "a.rrd")
        except WristError:
            assert not (folder / "a.rrd").exists()
            rows = 0
        assert code in (128 + number, -number, 0), err
        assert (code == 0) <= (rows == 40_000)
        return phase, code, rows

    found = in_pairs(once, enumerate(moments(calendar, [2, number], STOPS)))
    assert all(code == 128 + number or phase != "simulate" for phase, code, _ in found)
