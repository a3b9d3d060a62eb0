"""What all writers of result files share: attributes, space on the disk, files that appear whole."""

from __future__ import annotations

import errno
import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from catenary.solver.errors import RunBroken

# Room for HDF5's own tables and for the last words of a run that has filled the disk [bytes].
MARGIN = 128 * 1024


def plain(value: Any) -> Any:
    """``value`` made of what JSON knows: NumPy types converted, NaN and infinity as None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (set, frozenset)):
        return [plain(item) for item in sorted(value)]
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    return str(value)


def as_attribute(value: Any) -> Any:
    """``value`` as an HDF5 attribute: text and numbers as they are, lists and tables as JSON."""
    if isinstance(value, (str, bool, int, float, np.generic)):
        return value
    return json.dumps(plain(value), ensure_ascii=False)


def reserve(path: Path, start: int, n_bytes: int) -> None:
    """Claim ``n_bytes`` [bytes] on the disk from byte ``start`` of a file on. Not collective.

    HDF5 updates its tables in place and appends the data: if the disk fills up in between, the
    tables point to data that are not there and the file is lost. Claimed space excludes that.

    Raises
    ------
    OSError
        If the disk, a quota or a limit of the process leaves no room.
    """
    if not hasattr(os, "posix_fallocate"):  # not on macOS, where a full disk may cost the file
        return
    handle = os.open(path, os.O_RDWR)
    try:
        os.posix_fallocate(handle, start, n_bytes)
    except OSError as error:
        if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):  # a file system that cannot claim
            raise
    finally:
        os.close(handle)


def broken_write(path: Path, time: float, error: Exception) -> RunBroken:
    """The error for the user when writing ``path`` failed at ``time`` [s] of the simulation."""
    code = getattr(error, "errno", None)
    reason = os.strerror(code) if code else str(error)
    return RunBroken(
        f"writing {path} failed at t = {time:.3f} s ({reason}): free some space or choose another "
        "output folder; what was written before stays readable"
    )


def write_whole(path: Path, content: bytes | str) -> None:
    """Write a file so that it appears whole or not at all (temporary file, then rename)."""
    data = content.encode() if isinstance(content, str) else content
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        partial.write_bytes(data)
        os.replace(partial, path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise
