"""What an earlier sweep left of a variant: its record and its figures, if they are whole.

Not collective.
"""

from __future__ import annotations

import json
import logging
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from catenary.cases.studies.sweep.jobs import OF_PANTOGRAPH
from catenary.postproc.files.disk import plain
from catenary.postproc.read.validation import is_number

logger = logging.getLogger("catenary.sweep")

_SUM = "crc32"
# Numbers, or null, that sweeps and studies take from a summary.
_NUMBERS: tuple[tuple[str, ...], ...] = (
    ("march_wall_s",),
    ("simulated_s",),
    ("n_steps",),
    ("n_dofs",),
    ("supports", "max_uplift_mm"),
    ("droppers", "n_slackened"),
    ("droppers", "max_force_N"),
    ("droppers", "min_force_N"),
)


def record_text(record: Mapping[str, Any]) -> str:
    """A variant's record as the text of its file, with a checksum."""
    content = json.loads(json.dumps(plain(record)))
    return json.dumps({**content, _SUM: _sum(content)}, indent=1) + "\n"


def read_record(path: Path) -> dict[str, Any] | None:
    """A variant's record, None if there is none or it is damaged, which is logged."""
    content = _table(path)
    if content is None:
        return None
    known = content.pop(_SUM, None)
    fault = ""
    if known is not None and known != _sum(content):
        fault = "it differs from its checksum"
    elif not isinstance(content.get("config"), dict):
        fault = "config is no table"
    elif not is_number(content.get("wall_s", 0.0), 0.0):
        fault = "wall_s is no time"
    elif not isinstance(content.get("measured", {}), dict):
        fault = "measured is no table"
    return None if _is_damaged(path, fault) else content


def read_summary(path: Path) -> dict[str, Any] | None:
    """A variant's ``summary.json``, None if there is none or it is damaged, which is logged."""
    content = _table(path)
    if content is None or _is_damaged(path, _summary_fault(content)):
        return None
    return content


def _summary_fault(content: dict[str, Any]) -> str:
    """What is wrong with a summary, empty if nothing is."""
    found = content.get("pantographs")
    if not isinstance(found, list) or not found:
        return "pantographs is no list of tables"
    for one in found:
        if not isinstance(one, dict) or not isinstance(one.get("name"), str):
            return "pantographs is no list of tables"
        for column in OF_PANTOGRAPH:
            if column.name not in one or not _number_or_null(one[column.name]):
                return f"{column.name} is no number"
    for path in _NUMBERS:
        place: Any = content
        for key in path:
            place = place.get(key, "") if isinstance(place, dict) else ""
        if not _number_or_null(place):
            return f"{'.'.join(path)} is no number"
    if not isinstance(content.get("inner_iterations"), dict):
        return "inner_iterations is no table"
    return ""


def _number_or_null(value: Any) -> bool:
    return value is None or is_number(value)


def _table(path: Path) -> dict[str, Any] | None:
    """A JSON table, None if there is no file or no whole table in it, which is logged."""
    if not path.is_file():  # a pipe would be waited for
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        return None
    except (ValueError, RecursionError):
        _is_damaged(path, "it is no JSON")
        return None
    return (
        None
        if _is_damaged(path, "" if isinstance(content, dict) else "it is no table")
        else content
    )


def _is_damaged(path: Path, fault: str) -> bool:
    """Log that a file is damaged, if it is; returns whether it is."""
    if fault:
        logger.warning("%s is damaged (%s): its variant is run again", path, fault)
    return bool(fault)


def _sum(content: Mapping[str, Any]) -> int:
    return zlib.crc32(json.dumps(content, sort_keys=True).encode())
