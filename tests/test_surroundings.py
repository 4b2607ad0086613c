"""The command in surroundings that are not as usual: streams, letters, folders, names, and others who write there."""

import io
import json
import os
import subprocess
import sys

import pytest

from sampling import THOROUGH
from spherical_wrist import load_recording
from spherical_wrist.cli import main
from spherical_wrist.errors import RecordingError
from spherical_wrist.loop.object_cache import folder
from spherical_wrist.memory import LEAST, SAFE, MemoryLimitError, memory_warning

pytestmark = pytest.mark.slow
CODE = "from spherical_wrist.cli import main; main()"
RUN = ("run", "--duration", "0.1")


def wrist(*arguments, cwd, shell="", flags=(), code=CODE, without=(), **environment):
    """Runs the command; ``shell`` is what follows it in a shell."""
    names = {name: value for name, value in os.environ.items() if name not in without}
    full = [sys.executable, *flags, "-c", code, *arguments]
    if shell:
        full = ["bash", "-c", f'"$@" {shell}', "bash", *full]
    return subprocess.run(
        full, cwd=cwd, env={**names, **environment}, capture_output=True, check=False, stdin=subprocess.DEVNULL
    )


def one_line(done):
    text = done.stderr.decode()
    assert done.returncode == 2, text
    assert text.startswith("wrist: error: ")
    assert text.count("\n") == 1
    return text


@pytest.mark.parametrize("arguments", [("--version",), ("list", "--json")], ids=str)
def test_output_that_nobody_takes(tmp_path, arguments):
    assert "output cannot be written: No space" in one_line(wrist(*arguments, cwd=tmp_path, shell="> /dev/full"))
    if THOROUGH or arguments == ("--version",):
        closed = wrist(*arguments, cwd=tmp_path, shell=">&-")
        assert (closed.returncode, closed.stderr) == (0, b"")


WRONG = {"2>&-": ("guide", "none"), "2>/dev/full": ("run", "--law", "none")}
"""Commands that are wrong, the second of which imports most of the package before it says so."""


@pytest.mark.parametrize("shell", WRONG)
def test_errors_that_nobody_takes(tmp_path, shell):
    """Python's buffers, on which PYTHONUNBUFFERED decides, have no part in the exit code."""
    for variables in ({}, {"PYTHONUNBUFFERED": "1"}):
        for wrong in WRONG.values() if THOROUGH else [WRONG[shell] if not variables else ("guide", "none")]:
            done = wrist(*wrong, cwd=tmp_path, shell=shell, without=("PYTHONUNBUFFERED",), **variables)
            assert (done.returncode, done.stdout) == (2, b"")


def test_what_libraries_print_does_not_go_into_the_file_where_the_output_is_closed(tmp_path):
    assert wrist(*RUN, "-o", "a.rrd", cwd=tmp_path, shell=">&- 2>&- <&-").returncode == 0
    assert len(load_recording(tmp_path / "a.rrd")) == 100


def test_letters_that_the_output_does_not_have(tmp_path, monkeypatch):
    ascii_only = {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    table = wrist(*RUN, "-o", "τ.rrd", cwd=tmp_path, **ascii_only)
    assert (table.returncode, table.stderr) == (0, b"")
    assert b"attitude error, RMS" in table.stdout
    told = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdout", told)
    monkeypatch.setattr(sys, "argv", ["wrist", *RUN, "-o", "τ.rrd", "--json"])
    with pytest.raises(SystemExit):
        main()
    told.seek(0)
    assert json.loads(told.read())["recording"] == "τ.rrd"


def test_a_narrow_terminal_cuts_no_figures(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "20")
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(sys, "argv", ["wrist", *RUN, "--no-recording"])
    with pytest.raises(SystemExit):
        main()
    said = capsys.readouterr().out
    assert "attitude error, RMS" in said
    assert "…" not in said


LAW = """
from spherical_wrist.control import Law

class Mine(Law):
    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = signal.N[i]
"""
READS = f"""
import os
from spherical_wrist.loop import object_cache
read, nowhere = object_cache.read, os.environ["WRIST_CACHE_DIR"]
def kept(key):
    os.environ["WRIST_CACHE_DIR"] = os.environ["KEPT"]
    try:
        return read(key)
    finally:
        os.environ["WRIST_CACHE_DIR"] = nowhere
object_cache.read = kept
{CODE}
"""
"""The command with a cache that it reads, but cannot write to: it compiles what is not there."""


def test_nowhere_to_keep_a_cache(tmp_path):
    """No home, and no folder that could be written to: it compiles, and says so once.

    Nothing is kept; by default, what other tests use is taken from their cache, and only a new law is compiled.
    """
    law, work = tmp_path / "mine.py", tmp_path / "work"
    law.write_text(LAW)
    work.mkdir()
    nowhere = {"HOME": "/proc/nowhere", "WRIST_CACHE_DIR": "/proc/nowhere", "XDG_CACHE_HOME": "/proc/nowhere"}
    nowhere |= {"PYTHONDONTWRITEBYTECODE": "1", "KEPT": str(folder())}
    options = [] if THOROUGH else ["--law", f"{law}:Mine"]
    code = CODE if THOROUGH else READS
    done = wrist(*RUN, *options, "-o", "a.rrd", cwd=work, code=code, without=("MPLCONFIGDIR",), **nowhere)
    assert done.returncode == 0
    assert done.stderr.startswith(b"wrist: warning: compiled code cannot be kept in '/proc/nowhere'")
    assert done.stderr.count(b"\n") == 1
    assert [path.name for path in work.iterdir()] == ["a.rrd"]


def test_without_docstrings_and_assertions(tmp_path):
    done = wrist(*RUN, "-o", "a.rrd", cwd=tmp_path, flags=["-OO"])
    assert (done.returncode, done.stderr) == (0, b"")
    assert len(load_recording(tmp_path / "a.rrd")) == 100


def test_a_working_directory_that_was_deleted(tmp_path):
    gone = tmp_path / "gone"
    code = f"import os; os.mkdir('gone'); os.chdir('gone'); os.rmdir({str(gone)!r}); {CODE}"
    for arguments in (["-o", "a.rrd"], ["--no-recording", "--model", "a.xml"]):
        command = [sys.executable, "-c", code, *RUN, *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
        text = one_line(done)
        assert "No such file or directory" in text or "working directory was deleted" in text


NAMES = ["a b.rrd", "τ·µ.rrd", "a\nb.rrd", "-a.rrd", "'\".rrd", "a" * 251 + ".rrd"]


def test_any_name_of_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in NAMES:
        monkeypatch.setattr(sys, "argv", ["wrist", *RUN, "-o", name])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0
        assert len(load_recording(name)) == 100
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(NAMES)


def test_a_recording_whose_name_has_no_letters(tmp_path, monkeypatch):
    """It is written, and printing its name is no reason to fail; but Rerun cannot open it."""
    name = os.fsdecode(b"\xff.rrd")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="utf-8"))
    monkeypatch.setattr(sys, "argv", ["wrist", *RUN, "-o", name])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    with pytest.raises(RecordingError, match="rename it"):
        load_recording(tmp_path / name)
    (tmp_path / name).rename(tmp_path / "a.rrd")
    assert len(load_recording(tmp_path / "a.rrd")) == 100


def test_a_model_whose_name_has_no_letters(tmp_path):
    (tmp_path / os.fsdecode(b"\xff.xml")).write_text("<mujoco/>")
    assert "rename it" in one_line(wrist(*RUN, "--model", b"\xff.xml", "--no-recording", cwd=tmp_path))


TWO = """
import os, sys
import spherical_wrist.cli.run, spherical_wrist.simulation.simulate
from spherical_wrist.cli import main
duration = "0.1" if os.fork() else "0.2"
sys.argv = ["wrist", "run", "-o", "a.rrd", "--duration", duration]
try:
    main()
finally:
    if duration == "0.1":
        assert os.wait()[1] == 0
"""
"""Two processes, forked when the imports are done, run the command at the same time."""


def test_two_runs_at_once_onto_one_file(tmp_path):
    done = subprocess.run([sys.executable, "-c", TWO], cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert [path.name for path in tmp_path.iterdir()] == ["a.rrd"]
    assert len(load_recording(tmp_path / "a.rrd")) in (100, 200)


@pytest.mark.parametrize("limit", [80_000, 200_000, 500_000, 1_000_000])  # NumPy, LLVM or Rerun would end the process
def test_little_memory(tmp_path, limit):
    """A limit with which libraries cannot load is one line, before they try."""
    command = ["bash", "-c", f'ulimit -v {limit}; exec "$@"', "bash", sys.executable, "-c", CODE, *RUN]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
    assert f"ulimit -v {limit}" in one_line(done)


def test_a_limit_with_which_libraries_may_end_the_process_is_told(monkeypatch):
    for limit, said in ((None, False), (SAFE, False), (SAFE - 1, True), (LEAST, True)):
        monkeypatch.setattr("spherical_wrist.memory.address_limit", lambda limit=limit: limit)
        assert ("may end this command" in memory_warning()) == said
    monkeypatch.setattr("spherical_wrist.memory.address_limit", lambda: LEAST - 1)
    with pytest.raises(MemoryLimitError):
        memory_warning()


@pytest.mark.parametrize("setting", [("NUMBA_DISABLE_JIT", "1"), ("NUMBA_NUM_THREADS", "0")], ids=str)
def test_settings_of_the_compiler_with_which_it_cannot_work(tmp_path, setting):
    """They are told, and no law is blamed."""
    done = wrist(*RUN, "--no-recording", cwd=tmp_path, WRIST_CACHE_DIR=str(tmp_path), **dict([setting]))
    assert setting[0].split("_")[0] in one_line(done)
    assert "law" not in one_line(done)
