"""Signals are heard wherever they come, also where Python ignores what is raised."""

import os
import signal
import subprocess
import sys
import time
import weakref

import psutil
import pytest

from sampling import THOROUGH
from spherical_wrist.cli.signals import PATIENCE, Stopped, Watch, heard, noted, stopping, watched

SOON = 100_000
"""Turns of a loop within which a signal is handled."""


class Finalized:
    """Gets a signal in its finalizer."""

    def __init__(self, number):
        self.number = number

    def __del__(self):
        here(self.number)


class Plain:
    pass


def here(number, *_):
    os.kill(os.getpid(), number)
    for _ in range(SOON):
        pass


def by_finalizer(number):
    Finalized(number)


def by_weak_reference(number):
    thing = Plain()
    weakref.finalize(thing, here, number)
    del thing


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("where", [here, by_finalizer, by_weak_reference])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_heard(number, where):
    def work():
        where(number)
        for _ in range(200):
            time.sleep(0.01)

    before = signal.getsignal(number)
    with pytest.raises(Stopped) as stopped, stopping():
        work()
    assert stopped.value.number == number
    assert signal.getsignal(number) is before


@pytest.mark.parametrize("where", [here, by_finalizer])
def test_a_signal_is_noted_once_and_the_next_acts_as_usual(where):
    with noted() as received:
        where(signal.SIGINT)
        for _ in range(200):
            if received:
                break
            time.sleep(0.01)
        assert received == [signal.SIGINT]
        with pytest.raises(KeyboardInterrupt):
            here(signal.SIGINT)
    assert received == [signal.SIGINT]


ENDLESS = """from spherical_wrist.control import Law


class Compiled(Law):
    @staticmethod
    def step(signal, parameters, state, command):
        if signal.time > 0.01:
            x = 0.0
            while x < 1.0:
                x = x * 0.5
        for i in range(3):
            command.torque[i] = 0.1 * signal.error[i]


class Deaf(Law):
    @staticmethod
    def step(signal, parameters, state, command):
        while True:
            try:
                while True:
                    pass
            except BaseException:
                pass
"""
CASES = {
    "MuJoCo parses": ("run", "--model", "huge.xml"),
    "a law that hears nothing": ("run", "--law", "endless.py:Deaf"),
    "a compiled law": ("run", "--law", "endless.py:Compiled"),
    "a law in threads": ("compare", "--law", "endless.py:Deaf", "-o", "out"),
}
"""Commands that do not end by themselves."""


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES if THOROUGH else list(CASES)[:2])
def test_a_command_that_does_not_hear_is_ended(tmp_path, case):
    """The signal comes when the command has been at its work for a while; the process ends soon after it."""
    (tmp_path / "endless.py").write_text(ENDLESS)
    bodies = "".join(f"<body pos='{i} 0 0'><joint type='ball'/><geom size='.1'/></body>" for i in range(30_000))
    (tmp_path / "huge.xml").write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    command = [sys.executable, "-c", "from spherical_wrist.cli import main; main()", *CASES[case]]
    for seconds in (5.0,) if case == "a compiled law" else (1.5, 4.0, 10.0):  # imports take longer on a busy machine
        with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
            try:
                busy(psutil.Process(process.pid), seconds)
                process.send_signal(signal.SIGINT)
                _, err = process.communicate(timeout=PATIENCE + 20.0)  # two seconds where nothing else is done
            finally:
                process.kill()
        assert process.returncode == 130
        if err:  # otherwise it was not at its work yet, and heard
            break
    assert err == "wrist: error: stopped at once, since it did not end by itself\n"
    assert {path.name for path in tmp_path.iterdir()} <= {"endless.py", "huge.xml", "out", "__pycache__"}


def busy(process, seconds):
    """Wait until imports and compilation are over: it has used the processor for some seconds."""
    end = time.monotonic() + 120.0
    while sum(process.cpu_times()[:2]) < seconds:
        assert time.monotonic() < end
        assert process.is_running()
        time.sleep(0.05)


def test_a_command_that_saves_its_results_is_given_time(monkeypatch):
    ended = []
    monkeypatch.setattr("spherical_wrist.cli.signals.PATIENCE", 0.1)
    monkeypatch.setattr(Watch, "_end", lambda self, number: ended.append(number))
    with watched(), noted() as received:
        here(signal.SIGTERM)
        while not received:
            time.sleep(0.001)
        heard()
        time.sleep(0.3)
        assert not ended
    with watched(), noted():
        here(signal.SIGTERM)
        time.sleep(0.3)
    assert ended == [signal.SIGTERM]


def test_the_first_milliseconds(tmp_path):
    """From the first line of the command on, there is no traceback."""
    code = "import os, signal, sys\nfrom spherical_wrist import cli\n"
    code += "strike = lambda *_: os.kill(os.getpid(), signal.SIGINT)\n"
    code += "sys.meta_path.insert(0, type('Strike', (), {'find_spec': strike})())\n"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}sys.argv = ['wrist', 'list']\ncli.main()"], capture_output=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, b"", b"")
