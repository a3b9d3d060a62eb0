"""Sweeps of a case: each from its variants to its table or samples' evaluation, several as one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.errors import InputError
from catenary.base.files import is_there
from catenary.base.options import option
from catenary.base.parallel import on_root
from catenary.cases.result_folder.folder_lock import held
from catenary.cases.result_folder.output_folder import refuse_earlier
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.load import Draft
from catenary.cases.studies.sweep.jobs import (
    HISTORIES,
    Ended,
    Part,
    RunOptions,
    WholeRuns,
    check_names,
    in_order,
    whole_runs_of,
)
from catenary.cases.studies.sweep.sweep import RECORD, Record, other_value, refuse_other_sweep
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.files.run_schema import DONE
from catenary.postproc.report.study_table import Column, StudyTable, write_files

if TYPE_CHECKING:
    from catenary.cases.studies.sweep.together import Ensemble
    from catenary.cases.studies.uncertainty.evaluation import Uncertainty
    from catenary.cases.studies.uncertainty.sampling import SamplingTable


# Figures that differ between two runs of the same variant.
_OWN = ("wall_s", "remarks")


class Swept(NamedTuple):
    """A sweep that ended: how its variants did, in their order, the files, what samples say."""

    ended: list[Ended]
    files: list[Path]
    evaluated: Uncertainty | None

    @property
    def text(self) -> str:
        """Tables for a terminal: of the samples, or of all variants."""
        from catenary.cases.studies.sweep import output as of_variants
        from catenary.cases.studies.uncertainty import output as of_samples

        if self.evaluated is None:
            return of_variants.as_text(self.ended)
        return of_samples.as_text(self.evaluated)


class PlannedSweep(NamedTuple):
    """A sweep that can be run, from ``plan_sweep``.

    Attributes
    ----------
    own : whole runs of variants, or an ensemble that keeps statistics alone
    out : folder of the sweep
    sampling : what made the variants, if their table is to be evaluated
    """

    own: WholeRuns | Ensemble
    out: Path
    sampling: SamplingTable | None

    def run(
        self,
        comm: Any,
        options: RunOptions,
        command: str,
        plotted: Sequence[str] | None = (),
        histogram: bool = False,
    ) -> Swept:
        """Run what is not done yet, write table and pictures, and evaluate samples. Collective.

        Parameters
        ----------
        command : work of this process in words, for others that want the folder
        plotted : statistics that are drawn, of samples as points; the usual ones if there are none,
            no picture of None
        histogram : whether histograms of the contact forces are written too
        """

        with held(self.out, comm, command):
            on_root(comm, lambda: refuse_earlier(self.out, options.force))
            ended = self._ended(comm, options)
            files, evaluated = on_root(
                comm, lambda: self._write(ended, plotted, histogram), takes_long=True
            )
        return Swept(ended, files, evaluated)

    def _ended(self, comm: Any, options: RunOptions, part: Part | None = None) -> list[Ended]:
        """How all variants ended, in their order, or those of a part that can be run."""
        from catenary.cases.studies.sweep.run_jobs import run_jobs

        own = self.own
        if not isinstance(own, WholeRuns):
            return own.run(self.out, comm, options, part)
        if part is not None:
            return run_jobs(part.of(own.jobs), self.out, comm, options)
        ended = run_jobs(own.jobs, self.out, comm, options)
        return in_order(own.variants, ended, own.refused)

    def _write(
        self, ended: list[Ended], plotted: Sequence[str] | None, histogram: bool
    ) -> tuple[list[Path], Uncertainty | None]:
        """The files of a sweep that ended, and what samples say. Not collective."""
        from catenary.cases.studies.sweep.histories import FILE
        from catenary.cases.studies.sweep.output import files_of, table_of
        from catenary.cases.studies.uncertainty.output import write_evaluated

        own, evaluated = self.own, None
        lines = plotted if self.sampling is None else None
        case, scene = own.first.case.name, own.draft.table()
        files = write_files(self.out, files_of(case, ended, lines, histogram, scene))
        if not isinstance(own, WholeRuns) and own.histories:
            files += [path for path in (self.out / FILE,) if path.is_file()]
        if self.sampling is not None:
            rows = table_of(ended).records()
            evaluated, more = write_evaluated(self.out, rows, self.sampling, plotted or ())
            files += more
        return files, evaluated

    def run_part(self, part: Part, comm: Any, options: RunOptions) -> list[Ended]:
        """Run a part, as a task of a job array; returns how its variants ended. Collective.

        The part writes a table, and its sampling, to a folder of its own, for ``catenary merge``.
        If parts share a folder, the sweep run there after all of them writes the table of all
        variants.
        """
        from catenary.cases.studies.sweep.output import files_of
        from catenary.cases.studies.uncertainty.run_table import sampling_file

        ended = self._ended(comm, options, part)
        content = files_of(self.own.first.case.name, ended, None, scene=self.own.draft.table())
        if self.sampling is not None:
            content |= sampling_file(self.sampling)
        on_root(comm, lambda: write_files(self.out / part.folder, content), takes_long=True)
        return ended


def plan_sweep(
    draft: Draft,
    variants: Sequence[Variant],
    out: Path,
    sampling: SamplingTable | None = None,
    *,
    full_report: bool = False,
    only_statistics: bool = False,
    histories: Sequence[str] = (),
    force: bool = False,
) -> PlannedSweep:
    """A sweep of a case into a folder, all scenes checked. Not collective.

    Parameters
    ----------
    draft : of the case
    variants : of the sweep
    out : folder of the sweep
    sampling : what made the variants, if their table is to be evaluated
    full_report : whether each whole run gets a report
    only_statistics : whether it is an ensemble: there is no run of a variant on the disk, but for
        ``histories``, and scenes are checked when it is their turn
    histories : channels that an ensemble keeps over time
    force : whether a sweep with other variants there is replaced

    Raises
    ------
    InputError
        If one of ``histories`` is none, or whole runs are kept, which have them; if the folder has
        the table of another sweep, and ``force`` is not given; as ``whole_runs_of``.
    """
    check_names(histories, HISTORIES, "history")
    own: WholeRuns | Ensemble
    if only_statistics:
        from catenary.cases.studies.sweep.together import ensemble_of

        own = ensemble_of(draft, variants, histories)
    elif histories:
        raise InputError(
            f"{option('--histories', 'histories')} goes with "
            f"{option('--only-statistics', 'only_statistics')}: whole runs keep all in run.h5"
        )
    else:
        own = whole_runs_of(draft, variants, full_report)
    # Folders of whole runs are compared with the scene of each when it is their turn.
    refuse_other_sweep(out, variants, force, draft if only_statistics else None)
    return PlannedSweep(own, out, sampling)


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
    from catenary.cases.studies.uncertainty.run_table import read_sampling_beside

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


class WrittenMerged(NamedTuple):
    """Output of merged sweeps: files, the evaluation of samples, and the reason why histories are
    left out; empty if they are not."""

    files: list[Path]
    found: Uncertainty | None
    lacks: str


def write_merged(out: Path, merged: Merged) -> WrittenMerged:
    """Write the table of merged sweeps, their histories, and of samples the evaluation. Not
    collective."""
    from catenary.cases.studies.sweep.histories import FILE, merge_histories
    from catenary.cases.studies.sweep.output import table_files
    from catenary.cases.studies.uncertainty.output import write_evaluated

    rows, found = merged.record["rows"], None
    table = StudyTable([Column(name) for name in rows[0]], rows)
    files = write_files(out, table_files(merged.record, table))
    histories, lacks = merge_histories(out / FILE, merged.folders)
    files += histories
    if merged.sampling is not None:
        found, more = write_evaluated(out, rows, merged.sampling)
        files += more
    return WrittenMerged(files, found, lacks)


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
