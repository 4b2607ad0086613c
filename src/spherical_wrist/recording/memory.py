"""Memory of this machine."""

import os
import sys
from functools import cache


@cache
def memory() -> int:
    """Return how much memory a process may have here [bytes], without that of other programs."""
    installed = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else sys.maxsize
    if sys.platform == "win32":
        return installed
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return installed if limit == resource.RLIM_INFINITY else min(installed, limit)
