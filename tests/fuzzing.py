"""Tools of the fuzz tests: the number of examples, and the command in a process of its own that may die.

``wrist`` must take anything: it ends with exit code 0 or 1, or with 2 and one line that says what is wrong, soon, in
bounded memory, and leaves nothing in the folder that it was not asked for.
"""

import json
import os
import resource
import select
import shutil
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Any, NamedTuple

from hypothesis import HealthCheck, settings

from sampling import count

SOON = 30.0
"""Time [s] that no command may take, on a slow and busy machine."""
MEMORY = 2**31
"""Memory [bytes] that no command may need."""
ADDRESSES = 2**33
"""Address space [bytes] of the process: it would rather die than bring down the machine."""


def examples(whole: int) -> settings:
    """Return settings for so many examples, by default a sixth of them, without a limit on the time they take."""
    slow = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.data_too_large]
    return settings(
        max_examples=count(whole // 6, whole), deadline=None, suppress_health_check=[*slow, HealthCheck.filter_too_much]
    )


class Answer(NamedTuple):
    """Result of a command."""

    code: int
    out: str
    err: str
    memory: int


class Command:
    """``wrist`` in one process after another: a new one where the last has died."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def __call__(self, *arguments: str, cwd: Path) -> Answer:
        """Runs a command; fails where it takes too long or its process dies."""
        request = json.dumps([os.fspath(cwd), *arguments]).encode() + b"\n"
        process = self._alive()
        process.stdin.write(request)
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], SOON)
        line = process.stdout.readline() if ready else b""
        if line:
            answer = Answer(*json.loads(line))
            if answer.memory >= MEMORY:  # a process remembers its peak: the next command is not to be blamed for it
                self.close()
                self._process = None
            return answer
        if not ready:
            process.kill()
        code = process.wait()
        self._process = None
        raise AssertionError(f"wrist {' '.join(arguments)} {f'died ({code})' if ready else 'did not end'}")

    def _alive(self) -> Any:
        if self._process is None or self._process.poll() is not None:
            self._process = subprocess.Popen([sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            self._process.stdout.readline()  # it is ready
        return self._process

    def close(self) -> None:
        """Ends the process."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()


def outcome(command: Command, *arguments: str, cwd: Path, made: tuple[str, ...] = ()) -> Answer:
    """Runs a command in a folder and checks what must be true of any.

    Args:
        command: what runs it.
        arguments: of ``wrist``.
        cwd: the folder.
        made: names that it may leave there.
    """
    before = {path.name for path in cwd.iterdir()}
    answer = command(*arguments, cwd=cwd)
    assert "Traceback" not in answer.err, answer.err
    assert "encountered" not in answer.err, answer.err  # NumPy's warnings, of what we compute
    assert answer.code in (0, 1, 2)
    lines = [line for line in answer.err.splitlines() if not line.startswith("wrist: warning: ")]
    assert len(lines) == (answer.code == 2), answer.err
    assert all(line.startswith("wrist: error: ") and len(line) < 2000 for line in lines), answer.err
    strange = {path.name for path in cwd.iterdir()} - before - set(made if answer.code < 2 else ())
    assert not strange
    assert answer.memory < MEMORY
    return answer


def emptied(folder: Path) -> Path:
    """A folder with nothing in it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def _peak() -> int:
    """Largest memory of this process [bytes]; ``ru_maxrss`` begins with that of the process that started it."""
    status = Path("/proc/self/status")
    if status.is_file():
        (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
        return 1024 * int(line.split()[1])
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _serve() -> None:
    """Runs commands that come on the standard input, one line each."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answers, captured = os.fdopen(os.dup(1), "w"), [os.memfd_create("out"), os.memfd_create("err")]
    for number, file in enumerate(captured, start=1):
        os.dup2(file, number)  # also of what libraries print
    from spherical_wrist.cli import main

    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        cwd, *arguments = json.loads(line)
        os.chdir(cwd)
        for file in captured:
            os.ftruncate(file, 0)
            os.lseek(file, 0, os.SEEK_SET)
        sys.argv, code = ["wrist", *arguments], 0
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
        texts = [os.pread(file, 1 << 20, 0).decode(errors="replace") for file in captured]
        print(json.dumps([code, *texts, _peak()]), file=answers, flush=True)


if __name__ == "__main__":
    _serve()
