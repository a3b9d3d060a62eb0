"""A sweep of which statistics alone are kept: variants march together, in pieces of work."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from catenary.base.errors import CatenaryError, InputError
from catenary.base.parallel import on_root
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.process.petsc_options import start_petsc
from catenary.cases.process.workers import Outcome, WorkerLost, at_once
from catenary.cases.scene.input.faults import UnfitScene
from catenary.cases.scene.keys.keys import OF_THE_TRAIN
from catenary.cases.scene.load import Draft
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.sweep.jobs import (
    Ended,
    Part,
    RunOptions,
    all_ended,
    in_order,
    interrupted,
    scene_of,
)
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.evaluate.wording import duration
from catenary.postproc.files.run_schema import DONE, INTERRUPTED

# Variants of a piece of work at most: some seconds, that a stop may cost. Of few variants pieces
# are smaller, so that all cores have some, but fill four or eight lanes; they do not depend on the
# machine, as a sweep that was stopped may go on with more cores.
_MOST, _LEAST, _LANES, _PIECES = 64, 4, 8, 16


class Ensemble(NamedTuple):
    """Variants of a case.

    Attributes
    ----------
    draft : the case
    variants : in their order
    first : the scene of the first variant that can be run
    histories : which histories are kept, names out of ``jobs.HISTORIES``
    """

    draft: Draft
    variants: Sequence[Variant]
    first: Scene
    histories: tuple[str, ...] = ()

    @property
    def refused(self) -> list[Ended]:
        """Variants that cannot be run: none is known before its turn."""
        return []

    def run(
        self, out: Path | None, comm: Any, options: RunOptions, part: Part | None = None
    ) -> list[Ended]:
        """March what is not done yet; returns how variants ended, in their order. Collective.

        An interruption ends the list early and is its last entry. A variant that cannot be run, or
        breaks, stops no other.

        Parameters
        ----------
        out : folder in which pieces of work are kept, None to keep none
        comm : mpi4py communicator
        options : options of the runs
        part : part of the pieces of work, None for all
        """
        lots = -(-len(self.variants) // (_PIECES * _LANES))
        size = _LEAST if len(self.variants) <= _PIECES * _LEAST else min(_MOST, _LANES * lots)
        pieces = pieces_of_work(self.variants, size)
        if part is not None:
            pieces = part.of(pieces)
        content = json.dumps(self.draft.table(), sort_keys=True, default=str)
        case = hashlib.sha256(content.encode()).hexdigest()

        def depends_on(piece: Sequence[Variant]) -> list[Any]:
            assignments = [[variant.name, *variant.assignments] for variant in piece]
            return [case, assignments, *self.histories]

        kept, histories = KeptRows(out, options.force), None
        files: Sequence[Path | None] = [None] * len(pieces)
        if self.histories:
            assert out is not None
            from catenary.cases.studies.sweep.histories import KeptHistories

            sweep = hashlib.sha256(json.dumps(list(map(depends_on, pieces))).encode()).hexdigest()
            folder = None if part is None else part.folder
            kept = histories = KeptHistories(out, self.histories, sweep, options.force, folder)
            files = [histories.file_of(depends_on(piece)) for piece in pieces]
        if part is None:  # parts of a sweep share a folder, without a lock
            on_root(comm, kept.remove_parts)
        n_at_once = at_once(options.n_jobs, comm)
        if comm.size > 1:  # a march is one rank's: all without -j would do the same
            n_at_once = comm.size
        outcomes = kept.each(
            _March(self),
            list(zip(pieces, files, strict=True)),
            lambda item: depends_on(item[0]),
            n_at_once,
            comm,
            partial(start_petsc, list(options.petsc)),
        )
        ended = in_order(self.variants, _ended(outcomes, pieces, options.progress), ())
        if histories is not None and not interrupted(ended):
            variants = [one.variant for one in ended]
            own = {file: piece for file, piece in zip(files, pieces, strict=True) if file}
            on_root(comm, lambda: histories.join(variants, own), takes_long=True)
        return ended


def ensemble_of(
    draft: Draft, variants: Sequence[Variant], histories: Sequence[str] = ()
) -> Ensemble:
    """An ensemble of ``variants`` that keeps ``histories``, by name. Not collective.

    At least one variant can be run; those after the first such are checked at their turn.

    Raises
    ------
    InputError
        If no variant can be run, or if a value of a variant before the first possible one is out of
        bounds.
    """
    refused: CatenaryError | None = None
    for variant in variants:
        try:
            first = scene_of(draft, variant, len(variants) > 1)
            return Ensemble(draft, variants, first, tuple(histories))
        except UnfitScene as error:
            refused = refused or error
    assert refused is not None
    raise InputError(f"variant {variants[0].name}: {refused}") from refused


def _ended(
    outcomes: Iterable[Outcome],
    pieces: Sequence[Sequence[Variant]],
    progress: Callable[[str], None],
) -> list[Ended]:
    """Outcomes of the variants of all pieces, as these are done; the last one tells of a signal."""
    variants, ended = list(chain.from_iterable(pieces)), list[Ended]()
    begin = time.perf_counter()
    try:
        for outcome in outcomes:
            piece = pieces[outcome.number]
            if isinstance(outcome.error, WorkerLost):
                ended += [Ended(variant, str(outcome.error)) for variant in piece]
            else:
                rows = outcome.get()
                ended += [Ended(v, *row) for v, row in zip(piece, rows, strict=True)]
            spent, n_left = time.perf_counter() - begin, len(variants) - len(ended)
            progress(
                f"[{len(ended)}/{len(variants)}] {duration(spent)} gone, about "
                f"{duration(spent / len(ended) * n_left)} left"
            )
    except Interrupted:
        ended.append(Ended(variants[len(ended)], INTERRUPTED))
    return ended


def pieces_of_work(variants: Sequence[Variant], size: int) -> list[list[Variant]]:
    """Pieces of at most ``size`` variants each, those of a line together.

    Variants that come to these leave pieces as they are that are full and have one line, and those
    of lines with one variant each.
    """
    whole, begun = list[list[Variant]](), dict[tuple[str, ...], list[Variant]]()
    for variant in variants:
        # What its line depends on.
        changes = (one for one in variant.assignments if one.split(".")[0] not in OF_THE_TRAIN)
        own = begun.setdefault((variant.direction, *changes), [])
        own.append(variant)
        if len(own) == size:
            whole.append(own.copy())
            own.clear()
    left = list(chain.from_iterable(begun.values()))
    return whole + [left[at : at + size] for at in range(0, len(left), size)]


@dataclass
class Marching:
    """Marches variants of a case again and again.

    ``scene`` is the case as it is; ``out``, ``comm`` and ``options`` are those of ``Ensemble.run``.
    """

    draft: Draft
    scene: Scene
    out: Path | None
    comm: Any
    options: RunOptions

    def of(self, variants: Sequence[Variant]) -> list[Ended]:
        """Outcome of each variant, in their order. Collective.

        Raises
        ------
        InputError
            If none of them can be run.
        Interrupted
            If a signal came.
        """
        ended = ensemble_of(self.draft, variants).run(self.out, self.comm, self.options)
        self.options = self.options._replace(force=False)  # which would forget these
        return all_ended(ended)


class _March:
    """Marches a piece of variants; goes to the processes that do so."""

    def __init__(self, ensemble: Ensemble) -> None:
        self._draft, self._histories = ensemble.draft, ensemble.histories
        self._marches: Any = None

    def __call__(self, work: tuple[Sequence[Variant], Path | None], comm: Any) -> list[list[Any]]:
        """Of each variant the outcome, what is kept of its summary, no measures, and its share of
        the wall time [s]. Not collective.

        Parameters
        ----------
        work : variants, and the file of their histories
        """
        from catenary.cases.studies.ensemble import Marches
        from catenary.cases.studies.sweep.histories import piece_file

        piece, file = work
        rows: list[list[Any]] = [[] for _ in piece]
        scenes, numbers = [], []
        for number, variant in enumerate(piece):
            try:
                scenes.append(scene_of(self._draft, variant, several=True))
                numbers.append(number)
            except InputError as error:
                rows[number] = [str(error), {}]
        clock = time.perf_counter()
        if self._marches is None:
            self._marches = Marches()
        with piece_file(file, self._histories) as put:
            for marched in self._marches.of(scenes):
                number = numbers[marched.number]
                if marched.outcome == DONE:
                    put(number, marched.tables)
                rows[number] = [marched.outcome, marched.summary()]
        # They march side by side, so that none has a time of its own.
        wall = (time.perf_counter() - clock) / max(1, len(numbers))
        for number in numbers:
            rows[number] += [{}, wall]
        return rows

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_marches": None}
