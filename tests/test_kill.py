"""``wrist run`` killed at any moment of its life: its file is whole, or not there; and stopped, it keeps what it has.

Moments are seeded: a phase of its life (starting, simulating, recording, writing, naming the file and ending) and a
fraction of the time that this phase takes in an undisturbed run, as measured here.
"""

import os
import select
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue

import numpy as np
import pytest

from sampling import count, some
from spherical_wrist.errors import WristError
from spherical_wrist.inspection import inspect

AT_A_TIME = 2
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
KILLS = count(3 * len(PHASES), 10 * len(PHASES))
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
        """Waits until a phase begins."""
        while phase not in self.heard:
            self.heard.append(self.server.hear())
            assert self.heard[-1] in PHASES, self.errors.read_text()

    def end(self):
        """Waits for its end: exit code, the last phase that it was in, and what it said."""
        self.server.say("")
        while not self.heard or not self.heard[-1].startswith("ended"):
            self.heard.append(self.server.hear())
        return int(self.heard[-1].split()[1]), self.heard[-2], self.errors.read_text()

    def phases(self):
        """Return the time at which each phase began, since the start [s]."""
        times = []
        for phase in PHASES:
            self.wait_for(phase)
            times.append(time.monotonic() - self.began)
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
            assert select.select([self.told], [], [], 60.0)[0], "it says nothing"
            more = os.read(self.told, 4096)
            assert more, "it has ended"
            self.lines += more
        line, _, self.lines = self.lines.partition(b"\n")
        return line.decode()

    def close(self):
        self.process.stdin.close()
        try:
            self.process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:  # a life goes on in it, after a test that failed
            self.process.kill()
            self.process.wait()
        os.close(self.told)


@pytest.fixture(scope="module")
def servers():
    """Fork servers, as many as work at a time, cold and warm."""
    made, free = [], {False: SimpleQueue(), True: SimpleQueue()}
    for warm, queue in free.items():
        for _ in range(AT_A_TIME):
            made.append(ForkServer(*(WARM if warm else ())))
            queue.put(made[-1])
    yield free
    for server in made:
        server.close()


def on_a_free_server(free, work):
    """Do something with a free server, which is free again where nothing has failed."""
    server = free.get(timeout=120.0)
    done = work(server)
    free.put(server)
    return done


@pytest.fixture(scope="module")
def calendar(servers, old, tmp_path_factory):
    """Return the times at which phases begin and the process ends: two at a time, not the first runs here."""
    folders = [tmp_path_factory.mktemp("life") for _ in range(AT_A_TIME)]

    def watched(folder):
        return on_a_free_server(servers[False], lambda server: Life(server, folder, *OPTIONS).phases())

    return np.median(in_pairs(watched, folders), axis=0)


DURATION = 20
OPTIONS = ("--duration", str(DURATION), "--json")
ROWS = 1000 * DURATION


def moments(calendar, seed, number):
    """Phases, as often each, and times since they began [s]."""
    phase = np.arange(number) % len(PHASES)
    return list(
        zip(phase, np.random.default_rng(seed).uniform(0.0, 1.0, number) * np.diff(calendar)[phase], strict=True)
    )


def struck(servers, folder, number, moment):
    """Sends a signal to a run at a moment of its life."""
    phase, later = moment

    def strike(server):
        life = Life(server, folder, *OPTIONS)
        life.wait_for(PHASES[phase])
        time.sleep(later)
        os.kill(life.number, number)
        return life.end()

    return on_a_free_server(servers[PHASES[phase] != "start"], strike)


def in_pairs(work, items):
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        return list(pool.map(work, items))


def whole(file):
    """The number of rows of a recording, which must be in order."""
    return len(inspect(file).run)


@pytest.fixture(scope="module")
def old(servers, tmp_path_factory):
    """A recording of another run, as bytes."""
    folder = tmp_path_factory.mktemp("old")
    assert on_a_free_server(servers[True], lambda server: Life(server, folder, "--duration", "0.5").end())[0] == 0
    return (folder / "a.rrd").read_bytes()


def test_killed_at_any_moment_the_file_is_whole_or_not_there(servers, calendar, old, tmp_path):
    hit = Counter()

    def once(item):
        number, moment = item
        folder, before = tmp_path / str(number), number % 2 == 0
        folder.mkdir()
        if before:
            (folder / "a.rrd").write_bytes(old)
        code, phase, err = struck(servers, folder, signal.SIGKILL, moment)
        assert code in (-signal.SIGKILL, 0), err
        assert {path.name for path in folder.iterdir()} <= {"a.rrd"}
        if before and (folder / "a.rrd").read_bytes() == old:
            assert code
        elif before or (folder / "a.rrd").exists():
            assert whole(folder / "a.rrd") == ROWS
            assert phase == "name"
        else:
            assert code
        return phase if code else "done"

    hit.update(in_pairs(once, enumerate(moments(calendar, 1, KILLS))))
    print(f"phases begin at {np.round(calendar, 3)} s; kills in them: {dict(hit)}")
    assert all(hit[phase] for phase in ("start", "simulate", "record"))
    assert hit["write"] + hit["name"]  # short, so that a busy machine decides which of them it is


@pytest.mark.parametrize("number", some([signal.SIGTERM, signal.SIGINT], 2))
def test_stopped_at_any_moment_the_file_has_what_was_simulated_or_is_not_there(servers, calendar, tmp_path, number):
    def once(item):
        index, moment = item
        folder = tmp_path / str(index)
        folder.mkdir()
        code, phase, err = struck(servers, folder, number, moment)
        assert {path.name for path in folder.iterdir()} <= {"a.rrd"}
        assert "Traceback" not in err, err
        try:
            rows = whole(folder / "a.rrd")
        except WristError:
            assert not (folder / "a.rrd").exists()
            rows = 0
        assert code in (128 + number, -number, 0), err
        assert (code == 0) <= (rows == ROWS)
        return phase, code, rows

    found = in_pairs(once, enumerate(moments(calendar, [2, number], STOPS)))
    assert all(code == 128 + number or phase != "simulate" for phase, code, _ in found)
