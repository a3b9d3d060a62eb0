"""A sweep from its variants to its table, and with samples to their evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.base.parallel import on_root
from catenary.cases.result_folder.folder_lock import held
from catenary.cases.result_folder.output_folder import refuse_earlier
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
from catenary.cases.studies.sweep.sweep import refuse_other_sweep
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.report.study_table import write_files

if TYPE_CHECKING:
    from catenary.cases.studies.sampling.tables import SamplingTable
    from catenary.cases.studies.sweep.together import Ensemble
    from catenary.cases.studies.uncertainty.evaluation import Uncertainty


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
