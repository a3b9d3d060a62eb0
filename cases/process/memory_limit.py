"""A limit of the process's memory (``ulimit -v``) that is too low for the libraries themselves."""

from __future__ import annotations

import resource

# Address space that program and libraries take before any data, with a margin; a report of a short
# run was written within 0.7 GB, and OpenBLAS tries for ever to get memory within 0.45 GB [B].
LEAST = 700_000_000


def complaint() -> str:
    """Why the program cannot work within this process's limit, "" if it can. Not collective."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY or limit >= LEAST:
        return ""
    return (
        f"this process may take {limit / 1e6:.0f} MB of memory (ulimit -v), and the program with "
        f"its libraries needs {LEAST / 1e6:.0f} MB before any data; raise the limit"
    )
