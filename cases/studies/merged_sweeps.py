"""Sweeps of one case that ran in several folders, as one table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from catenary.base.errors import InputError
from catenary.base.files import is_there
from catenary.cases.scene.input.faults import shown
from catenary.cases.studies.sampling.tables import SamplingTable
from catenary.cases.studies.sweep.histories import FILE as HISTORIES
from catenary.cases.studies.sweep.histories import merge_histories
from catenary.cases.studies.sweep.output import table_files
from catenary.cases.studies.sweep.sweep import RECORD, Record, other_value
from catenary.cases.studies.uncertainty import output
from catenary.cases.studies.uncertainty.evaluation import Uncertainty
from catenary.cases.studies.uncertainty.run_table import read_sampling_beside
from catenary.postproc.files.run_schema import DONE
from catenary.postproc.report.study_table import Column, StudyTable, write_files

# Figures that differ between two runs of the same variant.
_OWN = ("wall_s", "remarks")


class Merged(NamedTuple):
    """Several sweeps as one.

    Attributes
    ----------
    record : that of a sweep with the variants of all
    sampling : that of all, None if there is none
    folders : of each variant the folder that its figures are from
    """

    record: dict[str, Any]
    sampling: SamplingTable | None
    folders: dict[str, Path]


def parts_of(folders: Sequence[Path]) -> list[Path]:
    """Folders of sweeps; in place of one that has no table the folders of parts in it. Not
    collective."""
    found: list[Path] = []
    for folder in folders:
        parts = [] if is_there(folder / RECORD) else sorted(folder.glob("part_*_of_*"))
        found += parts or [folder]
    return found


def merge(folders: Sequence[Path]) -> Merged:
    """Several sweeps as one.

    In place of a folder that has parts of a sweep alone these are taken. Variants may be disjoint
    or in several folders. A variant that broke in one folder and was run to its end in another is
    taken as done. Not collective.

    Raises
    ------
    InputError
        If a folder holds no sweep, or if two contradict each other: other cases, other values of
        them, other samplings, or a variant with other assignments or other figures.
    """
    folders = parts_of(folders)
    records = [_record(folder) for folder in folders]
    samplings = [read_sampling_beside(folder) for folder in folders]
    first, sampling = records[0], max(samplings, key=lambda one: 0 if one is None else one.n)
    for folder, record, other in zip(folders[1:], records[1:], samplings[1:], strict=True):
        for what, one, two in (
            ("case", first["case"], record["case"]),
            ("varied keys", first["varied"], record["varied"]),
            ("sampling", _endless(samplings[0]), _endless(other)),
        ):
            if one != two:
                raise InputError(f"{folder} cannot join {folders[0]}: they differ in the {what}")
        _refuse_other_scene(folder, record, folders[0], first)
    assignments: dict[str, tuple[Any, Path]] = {}
    rows: dict[str, tuple[list[dict[str, Any]], Path]] = {}
    for folder, record in zip(folders, records, strict=True):
        for variant in record["variants"]:
            name, own = variant["name"], variant["assignments"]
            known, of = assignments.setdefault(name, (own, folder))
            if known != own:
                raise InputError(
                    f"{folder} cannot join {of}: variant {name} has other assignments there"
                )
        for name, found in _by_variant(record["rows"]).items():
            known, of = rows.get(name, ([], folder))
            if not known or (_done(found) and not _done(known)):
                rows[name] = found, folder
            elif _done(found) and _done(known) and not _agree(found, known):
                raise InputError(f"{folder} cannot join {of}: variant {name} has other figures")
    # Samples by their numbers, so that all orders of the folders give one table.
    order = sorted(rows) if sampling is not None else list(rows)
    merged = {
        "case": first["case"],
        "varied": first["varied"],
        "scene": first["scene"],
        "wall_s": sum(record["wall_s"] for record in records),
        "variants": [
            {"name": name, "assignments": assignments[name][0]}
            for name in order
            if name in assignments
        ],
        "rows": [row for name in order for row in rows[name][0]],
    }
    return Merged(merged, sampling, {name: rows[name][1] for name in order})


class Written(NamedTuple):
    """Output of merged sweeps: files, the evaluation of samples, and the reason why histories are
    left out; empty if they are not."""

    files: list[Path]
    found: Uncertainty | None
    lacks: str


def write(out: Path, merged: Merged) -> Written:
    """Write the table of merged sweeps, their histories, and of samples the evaluation. Not
    collective."""
    rows, found = merged.record["rows"], None
    table = StudyTable([Column(name) for name in rows[0]], rows)
    files = write_files(out, table_files(merged.record, table))
    histories, lacks = merge_histories(out / HISTORIES, merged.folders)
    files += histories
    if merged.sampling is not None:
        found, more = output.write_evaluated(out, rows, merged.sampling)
        files += more
    return Written(files, found, lacks)


def _refuse_other_scene(
    folder: Path, record: dict[str, Any], of: Path, first: dict[str, Any]
) -> None:
    """Refuse sweeps whose variants differ from other values, if their records have these."""
    if record["scene"] is None or first["scene"] is None:
        return
    other = other_value(first["scene"], record["scene"], first["varied"])
    if other is not None:
        key, one, two = other
        raise InputError(
            f"{folder} cannot join {of}: {key} is {shown(two)} there, and {shown(one)} here"
        )


def _endless(sampling: SamplingTable | None) -> SamplingTable | None:
    """A sampling without its number of samples, where that does not change the first ones."""
    extends = sampling is not None and sampling.method in ("sobol", "random")
    return sampling.model_copy(update={"n": 2}) if sampling is not None and extends else sampling


def _record(folder: Path) -> dict[str, Any]:
    """The record of a sweep's folder, checked to be one."""
    path = folder / RECORD
    try:
        found = Record.model_validate_json(path.read_bytes())
        whole = {frozenset(row) for row in found.rows} == {frozenset(found.rows[0])}
        whole = whole and all(isinstance(row.get("variant"), str) for row in found.rows)
    except OSError as error:
        raise InputError(f"{folder} holds no sweep: {path} cannot be read") from error
    except (ValueError, IndexError):
        whole = False
    if not whole:
        raise InputError(f"{path} is damaged; the sweep's command writes it again")
    return found.model_dump()


def _by_variant(rows: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    found: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        found.setdefault(row["variant"], []).append(row)
    return found


def _done(rows: Sequence[dict[str, Any]]) -> bool:
    return all(row.get("outcome") == DONE for row in rows)


def _agree(one: Sequence[dict[str, Any]], two: Sequence[dict[str, Any]]) -> bool:
    """Whether two runs of one variant have the same figures but for rounding and wall times."""
    return len(one) == len(two) and all(
        _same(value, own[name])
        for row, own in zip(one, two, strict=True)
        for name, value in row.items()
        if name not in _OWN
    )


def _same(one: Any, two: Any) -> bool:
    if isinstance(one, float) and isinstance(two, float):
        # Processors round in other ways; switching contacts let that grow.
        return math.isclose(one, two, rel_tol=1e-6, abs_tol=1e-6)
    return bool(one == two)
