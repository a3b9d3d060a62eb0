"""The record that a sweep has left in its folder, and in what another sweep differs from it.

Two sweeps are of one scene if the records of both have its tables.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from catenary.base.errors import InputError
from catenary.base.files import is_file
from catenary.cases.result_folder.output_folder import (
    another_folder,
    force_option,
    refuse_impossible,
)
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.load import Draft
from catenary.cases.studies.sweep.variants import Variant

RECORD = "sweep.json"
# Tables that no figure of a variant depends on.
_IDLE = ("case", "output", "test")


class RecordedVariant(BaseModel):
    """A variant, as the record of a sweep has it."""

    name: str
    assignments: Any


class Record(BaseModel):
    """Record of a sweep, as far as it is read."""

    case: str
    varied: list[str]
    wall_s: float
    variants: list[RecordedVariant]
    rows: list[dict[str, Any]]
    scene: dict[str, Any] | None = None


def other_value(
    one: Mapping[str, Any], two: Mapping[str, Any], varied: Sequence[str]
) -> tuple[str, Any, Any] | None:
    """The first value in which two scenes differ and on which figures may depend: its key and both
    values. None if they do not differ.

    Parameters
    ----------
    one, two : tables of the scenes, as records of sweeps have them
    varied : keys that variants set, so that it does not matter what the scenes have there
    """
    for key, here, there in differences(one, two):
        sets = any(f"{key}.".startswith(f"{own}.") for own in varied)
        # Files may stand in other folders of other machines.
        elsewhere = key.endswith("file") and Path(str(here)).name == Path(str(there)).name
        if key.split(".")[0] not in _IDLE and not sets and not elsewhere:
            return key, here, there
    return None


def differences(one: Any, two: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Keys of tables, and of lists of one length, with the values in which they differ."""
    pairs: list[tuple[str, Any, Any]]
    if isinstance(one, Mapping) and isinstance(two, Mapping):
        pairs = [(name, one.get(name), two.get(name)) for name in dict.fromkeys([*one, *two])]
    elif isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        pairs = [(str(i), a, b) for i, (a, b) in enumerate(zip(one, two, strict=True))]
    else:
        if one != two:
            yield key, one, two
        return
    for name, a, b in pairs:
        yield from differences(a, b, f"{key}.{name}" if key else name)


def refuse_other_sweep(
    out: Path, variants: Sequence[Variant], force: bool, draft: Draft | None = None
) -> None:
    """Raise InputError if ``out`` has a table of another sweep, unless ``force``: of variants that
    this one has not, or that have other values here, or of another scene than that of ``draft``.

    Folders of whole runs are compared with the ``draft`` of each when it is their turn.
    """
    refuse_impossible(out)
    path = out / RECORD
    if force or not is_file(path):
        return
    try:
        record = Record.model_validate_json(path.read_bytes())
    except (OSError, ValueError):
        return
    there = {one.name: one.assignments for one in record.variants}
    here = {variant.name: list(variant.assignments) for variant in variants}
    replace = f"{another_folder()}, or give {force_option()} to replace it"
    if other := sorted(there.keys() - here.keys()):
        raise InputError(
            f"{path} is the table of a sweep with other variants ({other[0]}); {replace}"
        )
    if other := sorted(name for name, values in there.items() if values != here[name]):
        raise InputError(f"{path} is the table of a sweep with another {other[0]}; {replace}")
    if draft is None or not record.scene:
        return
    own = json.loads(json.dumps(draft.table(), default=str))
    if (differs := other_value(record.scene, own, record.varied)) is not None:
        key, value, wanted = differs
        raise InputError(
            f"{path} is the table of a sweep with {key} = {shown(value)}, here it is "
            f"{shown(wanted)}; {replace}"
        )
