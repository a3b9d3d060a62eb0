"""A folder for Matplotlib's own cache where the user has no home that can be written."""

from __future__ import annotations

import logging
import os
from pathlib import Path

from catenary.solver.base.kernels import loop_cache

VARIABLE = "MPLCONFIGDIR"


def settle() -> None:
    """Set Matplotlib's variable, before it is imported, unless its default will do."""
    if VARIABLE in os.environ or _may_be_made(_default()):
        return
    for base in loop_cache.bases():
        if loop_cache.is_writable(base):
            os.environ[VARIABLE] = str(base / "matplotlib")
            return
    # It takes a temporary folder for this process; its warning is not needed.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _default() -> Path:
    try:
        return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "matplotlib"
    except RuntimeError:  # a user without a home
        return Path("/nonexistent")


def _may_be_made(path: Path) -> bool:
    """Whether a folder is there and can be written, or can be made."""
    there = next((one for one in (path, *path.parents) if one.exists()), None)
    return there is not None and there.is_dir() and os.access(there, os.W_OK | os.X_OK)
