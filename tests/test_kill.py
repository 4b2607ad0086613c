"""``wrist run`` killed at any moment of its life: its file is whole, or not there; and stopped, it keeps what it has.

Moments are seeded: a phase of its life (starting, simulating, recording, writing, naming the file and ending) and a
fraction of the time that this phase takes in an undisturbed run, as measured here. Where the machine was busy then and
is not now, a run may have left the phase before it is struck: then the next one is struck sooner.
"""

import os
import select
import signal
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pytest

from sampling import count, some
from spherical_wrist import Experiment, record, simulate
from spherical_wrist.errors import WristError
from spherical_wrist.inspection import inspect

SERVER = """
import importlib, os, sys
to, modules = int(sys.argv[1]), sys.argv[2:]
for name in modules:
    importlib.import_module(name)

while line := sys.stdin.readline():
    born = os.fork()
    if not born:
        break
    sys.stdin.readline()
    os.write(to, f"ended {os.waitstatus_to_exitcode(os.waitpid(born, 0)[1])}\\n".encode())
else:
    sys.exit()

folder, errors, *options = line.strip().split("\\t")
os.chdir(folder)
os.dup2(os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
sys.argv, phases = ["wrist", "run", "-o", "a.rrd", *options], ["start"]
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
os.write(to, f"{os.getpid()}\\nstart\\n".encode())
sys.addaudithook(listen)
from spherical_wrist.cli import main
main()
"""
"""Fork server: each line of input, with a folder, a file for errors, and options, forks a run of the command.

A run lives to the end of its interpreter. It tells through a pipe what it is about to do: Python's own audit events say
so. The next line allows to wait for its end: until then its process id stays its own.
"""
PHASES = ("start", "simulate", "record", "write", "name")
"""Importing and compiling; simulating; making the recording; writing a file without a name; naming it, and the end."""
USED = ("app", "run", "output", "signals", "tables")
WARM = (
    *(f"spherical_wrist.cli.{name}" for name in USED),
    "spherical_wrist.experiment.command",
    "spherical_wrist.simulation.simulate",
)
"""Modules that the command imports before it simulates: imported already where its start is not what is struck."""
LASTING = PHASES[:3]
"""Phases that take long enough to be met for certain; a busy machine decides which of the others it is."""
SOONEST = 1e-3
"""Delay [s] after which a phase that is over is met by no shorter one."""
KILLS = count(2 * len(PHASES), 10 * len(PHASES))
STOPS = count(len(PHASES), 2 * len(PHASES))

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "O_TMPFILE"), reason="needs files without a name"),
]


class Life:
    """A run of the command into a folder, watched."""

    def __init__(self, server, folder, *options):
        self.server, self.errors, self.heard = server, folder.with_suffix(".err"), []
        self.began = time.monotonic()
        server.say("\t".join((str(folder), str(self.errors), *options)))
        self.number = int(server.hear())

    def wait_for(self, phase):
        """Waits until a phase begins; returns the time since the start [s]."""
        while phase not in self.heard:
            self.heard.append(self.server.hear())
            assert self.heard[-1] in PHASES, self.errors.read_text()
        return time.monotonic() - self.began

    def end(self):
        """Waits for its end: exit code, the last phase that it was in, and what it said."""
        self.server.say("")
        while not self.heard or not self.heard[-1].startswith("ended"):
            self.heard.append(self.server.hear())
        return int(self.heard[-1].split()[1]), self.heard[-2], self.errors.read_text()

    def phases(self):
        """Return the time at which each phase began, and that of its end, since the start [s]."""
        times = [self.wait_for(phase) for phase in PHASES]
        assert self.end()[0] == 0
        return [*times, time.monotonic() - self.began]


class ForkServer:
    """Process that forks runs, one at a time, which find modules imported."""

    def __init__(self, *modules):
        read, write = os.pipe()
        self.process = subprocess.Popen(
            [sys.executable, "-c", SERVER, str(write), *modules],
            pass_fds=[write],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
        )
        os.close(write)
        self.told, self.lines = read, b""

    def say(self, text):
        self.process.stdin.write(f"{text}\n".encode())
        self.process.stdin.flush()

    def hear(self):
        """Return the next line from there."""
        while b"\n" not in self.lines:
            assert select.select([self.told], [], [], 120.0)[0], "it says nothing"
            more = os.read(self.told, 4096)
            assert more, "it has ended"
            self.lines += more
        line, _, self.lines = self.lines.partition(b"\n")
        return line.decode()

    def close(self):
        self.process.stdin.close()
        try:
            self.process.wait(timeout=30.0)
        except subprocess.TimeoutExpired:  # a life goes on in it, after a test that failed
            self.process.kill()
            self.process.wait()
        os.close(self.told)


@pytest.fixture(scope="module")
def servers():
    """Two fork servers: cold, and warm."""
    made = {False: ForkServer(), True: ForkServer(*WARM)}
    yield made
    for server in made.values():
        server.close()


@pytest.fixture(scope="module")
def lasts(servers, tmp_path_factory):
    """Duration of each phase [s], where it is struck: the start of a cold run, the others of a warm one."""
    times = Life(servers[True], tmp_path_factory.mktemp("warm"), *OPTIONS).phases()
    cold = Life(servers[False], tmp_path_factory.mktemp("cold"), *OPTIONS)
    start = cold.wait_for("simulate")
    os.kill(cold.number, signal.SIGKILL)
    cold.end()
    return dict(zip(PHASES, np.diff(times).tolist(), strict=True)) | {"start": start}


DURATION = 10
OPTIONS = ("--duration", str(DURATION), "--json")
ROWS = 1000 * DURATION


def moments(lasts, seed, number):
    """Phases, as often each, and times since they began [s]."""
    random = np.random.default_rng(seed).uniform(0.0, 1.0, number)
    return [(phase, share * lasts[phase]) for phase, share in zip((PHASES * number)[:number], random, strict=True)]


def struck(servers, folder, number, phase, later):
    """Send a signal to a run at a moment of its life: its exit code, the phase that it was in, what it said."""
    life = Life(servers[phase != "start"], folder, *OPTIONS)
    life.wait_for(phase)
    time.sleep(later)
    os.kill(life.number, number)
    return life.end()


def met(moments, strike):
    """Strike at every moment, and again and sooner where a lasting phase was over; yield what was found each time."""
    for number, (phase, later) in enumerate(moments):
        for attempt in range(100):
            sooner = later / 2.0**attempt
            found = strike(f"{number}-{attempt}", number, phase, sooner)
            yield found
            if found[0] == phase or phase not in LASTING or sooner < SOONEST:
                break


def whole(file):
    """The number of rows of a recording, which must be in order."""
    return len(inspect(file).run)


@pytest.fixture(scope="module")
def old(tmp_path_factory):
    """A recording of another run, as bytes."""
    path = tmp_path_factory.mktemp("old") / "a.rrd"
    record(simulate(Experiment(duration=0.5)), path)
    return path.read_bytes()


def test_killed_at_any_moment_the_file_is_whole_or_not_there(servers, lasts, old, tmp_path):
    def strike(name, number, phase, later):
        folder, before = tmp_path / name, (number % 2 == 0)
        folder.mkdir()
        if before:
            (folder / "a.rrd").write_bytes(old)
        code, phase, err = struck(servers, folder, signal.SIGKILL, phase, later)
        assert code in (-signal.SIGKILL, 0), err
        assert {path.name for path in folder.iterdir()} <= {"a.rrd"}
        if before and (folder / "a.rrd").read_bytes() == old:
            assert code
        elif before or (folder / "a.rrd").exists():
            assert whole(folder / "a.rrd") == ROWS
            assert phase == "name"
        else:
            assert code
        return phase if code else "done", code

    hit = Counter(phase for phase, _ in met(moments(lasts, 1, KILLS), strike))
    print(f"phases last {lasts} s; kills in them: {dict(hit)}")
    assert all(hit[phase] for phase in LASTING)
    assert hit["write"] + hit["name"]


@pytest.mark.parametrize("number", some([signal.SIGTERM, signal.SIGINT], 2))
def test_stopped_at_any_moment_the_file_has_what_was_simulated_or_is_not_there(servers, lasts, tmp_path, number):
    def strike(name, _, phase, later):
        folder = tmp_path / name
        folder.mkdir()
        code, phase, err = struck(servers, folder, number, phase, later)
        assert {path.name for path in folder.iterdir()} <= {"a.rrd"}
        assert "Traceback" not in err, err
        try:
            rows = whole(folder / "a.rrd")
        except WristError:
            assert not (folder / "a.rrd").exists()
            rows = 0
        assert code in (128 + number, -number, 0), err
        assert (code == 0) <= (rows == ROWS)
        return phase, code

    found = list(met(moments(lasts, [2, number], STOPS), strike))
    assert all(code == 128 + number for phase, code in found if phase == "simulate")
