"""A script that becomes another program, which ends when the one that started it does, however that ends.

Run as ``python -I leash.py PARENT PROGRAM ARGUMENTS…``. Only Linux can do this; elsewhere the program is just run.
"""

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def main() -> None:
    """Takes the leash and becomes the program."""
    parent, program, *arguments = sys.argv[1:]
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != int(parent):  # it ended before the leash was on
            sys.exit(1)
    os.execv(program, [program, *arguments])


if __name__ == "__main__":
    main()
