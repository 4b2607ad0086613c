"""Rerun's own program as a child process that does not outlive this one."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import IO

from spherical_wrist.errors import ViewerError, one_line

HOST = "127.0.0.1"
"""Host on which everything listens: nobody else in the network is to see a recording."""

_GRACE = 5.0
"""Time in which the program must end when it is asked to [s]; then it is killed."""

_DIE_WITH_PARENT = Path(__file__).with_name("die_with_parent.py")

_NO_GRAPHICS = ("graphics adapter", "render context", "wgpu", "vulkan", "libvulkan")


class Viewer:
    """Rerun's program while it runs.

    Attributes:
        process: the child process.
    """

    def __init__(self, process: "subprocess.Popen[bytes]", output: IO[bytes]) -> None:
        self.process = process
        self._output = output

    @property
    def running(self) -> bool:
        """True if it has not ended yet."""
        return self.process.poll() is None

    def wait(self) -> None:
        """Wait until it ends.

        Raises:
            ViewerError: it could not do its work.
        """
        if self.process.wait() != 0:
            raise self.complaint()

    def complaint(self) -> ViewerError:
        """Return the reason for its end, from its output, as an error in one line."""
        self._output.seek(0)
        text = self._output.read().decode(errors="replace")
        lines = [line.strip() for line in text.splitlines() if "rror" in line or "panicked" in line]
        if any(word in line.lower() for line in lines for word in _NO_GRAPHICS):
            return ViewerError(
                "the viewer finds no graphics that it can draw with: install a driver, or Vulkan in software (on "
                "Debian: apt-get install libvulkan1 mesa-vulkan-drivers)"
            )
        said = f": {one_line(lines[-1])}" if lines else ""
        return ViewerError(f"the viewer ended with exit code {self.process.returncode}{said}")


@contextmanager
def rerun_process(arguments: Sequence[str], environment: Mapping[str, str] | None = None) -> Iterator[Viewer]:
    """Run Rerun's program with these arguments, bound to the loopback interface, and ends it on leaving.

    It sends no telemetry, and does not touch what the user has configured about that.

    Args:
        arguments: of the program.
        environment: variables that it gets besides those of this process.

    Raises:
        ViewerError: the program is not there.
    """
    # CI=true is how Rerun is asked not to send telemetry for this process alone
    variables = {**os.environ, "CI": "true", "NO_COLOR": "1", **(environment or {})}
    command = [sys.executable, "-I", str(_DIE_WITH_PARENT), str(os.getpid()), _program(), *arguments, "--bind", HOST]
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(command, env=variables, stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        try:
            yield Viewer(process, output)
        finally:
            _end(process)


def _program() -> str:
    """Rerun's program; as in Rerun itself, ``RERUN_CLI_PATH`` takes its place."""
    found = find_spec("rerun_cli")  # which it is packed in
    folder = Path(found.origin or "").parent if found is not None else Path()
    bundled = folder / "Rerun.app" / "Contents" / "MacOS" / "Rerun"
    path = os.environ.get("RERUN_CLI_PATH") or str(bundled if bundled.exists() else folder / "rerun")
    if not os.access(path, os.X_OK):
        raise ViewerError(f"Rerun's program is not at {path!r}: install rerun-sdk again, or unset RERUN_CLI_PATH")
    return path


def _end(process: "subprocess.Popen[bytes]") -> None:
    try:
        if process.poll() is None:
            process.terminate()
            process.wait(_GRACE)
    except subprocess.TimeoutExpired:
        pass
    finally:  # also where a second Ctrl-C interrupts the waiting
        process.kill()
        process.wait()
