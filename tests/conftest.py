"""Fixtures that every test may use."""

import gc
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

from sampling import count
from spherical_wrist.cli import main
from spherical_wrist.loop.engine import Engine, compiled_engine
from spherical_wrist.wrist import Wrist

# the first call of a test may compile for seconds; on CI a failure must come back when it is run again
settings.register_profile("wrist", max_examples=count(25, 100), deadline=None, derandomize="CI" in os.environ)
settings.load_profile("wrist")

# one cache of compiled code for all workers and for commands that run in another home
os.environ.setdefault("WRIST_CACHE_DIR", str(Path(__file__).parents[1] / ".pytest_cache" / "compiled"))

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in the background of a shell, which all tests would inherit
    signal.signal(signal.SIGINT, signal.default_int_handler)

LOOP = "from spherical_wrist import Experiment, simulate; simulate(Experiment(duration=0.01))"
LAWS = """if True:
    from spherical_wrist.control import Law
    from spherical_wrist.loop.compiler import compiled_law
    for law in list(Law.members.values())[{first}::2]:
        compiled_law(law())"""
WARM_UP = (LOOP, LAWS.format(first=0), LAWS.format(first=1))
"""Programs that fill the cache of compiled code: the loop, and half of the laws each."""


def pytest_sessionstart(session):
    """Before several workers start, compile the loop and the laws, so that no two workers compile the same."""
    if session.config.getoption("dist", "no") != "no" and not hasattr(session.config, "workerinput"):
        for process in [subprocess.Popen([sys.executable, "-c", program]) for program in WARM_UP]:
            process.wait()


SPREAD = {"test_disk", "test_readme", "test_surroundings"}
"""Files whose tests share no fixture and take long: any worker runs any of them."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Keep the tests of a file on one worker, so that its fixtures are made once, except those of SPREAD."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            file = nodeid.partition("::")[0]
            return nodeid if Path(file).stem in SPREAD else file

    return Scheduling(config, log)


def pytest_collection_modifyitems(config, items):
    """On several workers, begin with the slow tests: no worker is left alone with a long one in the end."""
    if not hasattr(config, "workerinput"):
        return
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: (item.path not in slow, item.get_closest_marker("slow") is None))


def pytest_collection_finish(session):
    """Keep the collector of garbage from going through all modules and tests again and again."""
    gc.freeze()


def pytest_unconfigure(config):
    """Let what was kept be freed, which some modules check at the end."""
    gc.unfreeze()


@pytest.fixture(scope="session")
def nominal() -> Wrist:
    """Return the wrist that comes with the package."""
    return Wrist.load()


@pytest.fixture(scope="session")
def engine() -> Engine:
    """Return the compiled loop."""
    return compiled_engine()


@pytest.fixture
def wrist(capsys, monkeypatch, tmp_path):
    """Run the command in this process, in an empty folder; return exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def command(*arguments):
        monkeypatch.setattr(sys, "argv", ["wrist", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        printed = capsys.readouterr()
        return end.value.code or 0, printed.out, printed.err

    return command
