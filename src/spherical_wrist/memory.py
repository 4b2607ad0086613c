"""Memory of this machine, and limits on the addresses that a process may reserve (``ulimit -v``)."""

import os
import sys
from functools import cache

from spherical_wrist.errors import WristError

LEAST, SAFE = 1 << 30, 1 << 32
"""Bytes of addresses with fewer than which no run is recorded, and with which every command was seen to work.

NumPy's OpenBLAS, LLVM and Rerun reserve several times what they use, the more the more threads a machine has (a run of
10 s reserves 3.5 GB on two cores, and uses 0.26 GB). Where there is no room they end the process themselves, with words
of their own, which nothing in it can prevent.
"""


class MemoryLimitError(WristError):
    """Limit on memory with which no command can work."""


@cache
def memory() -> int:
    """Return how much memory a process may have here [bytes], without that of other programs."""
    installed = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else sys.maxsize
    return min(installed, address_limit() or installed)


def address_limit() -> int | None:
    """Return the limit on the addresses of this process [bytes]; None without one."""
    if sys.platform == "win32":
        return None
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if limit == resource.RLIM_INFINITY else limit


def memory_warning() -> str:
    """Return a warning if memory is limited so that libraries may end the process; empty if it is not.

    Raises:
        MemoryLimitError: the limit is too low for any command.
    """
    limit = address_limit()
    if limit is None or limit >= SAFE:
        return ""
    said = f"memory is limited to {limit / 1e9:.2g} GB of addresses (ulimit -v {limit >> 10})"
    if limit < LEAST:
        raise MemoryLimitError(f"{said}, and NumPy, LLVM and Rerun reserve more: give {SAFE / 1e9:.2g} GB")
    return f"{said}: NumPy, LLVM and Rerun reserve more, and may end this command; {SAFE / 1e9:.2g} GB are safe"
