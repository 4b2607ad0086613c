"""Script that becomes another program, which the kernel kills when its parent ends.

Run as ``python -I die_with_parent.py PARENT PROGRAM ARGUMENTS…``. Only Linux can do this;
elsewhere the program is just run.
"""

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def main() -> None:
    """Ask the kernel to kill this process with its parent, and become the program."""
    parent, program, *arguments = sys.argv[1:]
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != int(parent):  # it ended before the request
            sys.exit(1)
    os.execv(program, [program, *arguments])


if __name__ == "__main__":
    main()
