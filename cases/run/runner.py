"""From a scene to a judged contact force: mesh, equilibrium, march, recorder, report.

Data flows one way; every phase is timed and is a PETSc log stage of the same name. What reads a
result file is imported by runs that continue one.
"""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from catenary.base.errors import CatenaryError, RunBroken
from catenary.base.mpi import MPI
from catenary.base.parallel import on_root
from catenary.base.petsc import PETSc
from catenary.base.process import give_back
from catenary.cases.process.interrupts import Phase, StopRequest
from catenary.cases.result_folder.folder_lock import held
from catenary.cases.result_folder.output_folder import (
    RunSize,
    check_room_to_continue,
    check_size,
    prepare,
)
from catenary.cases.run.header import header_of
from catenary.cases.run.needs import flush_cadence, needs_before_meshing, needs_with_mesh, run_size
from catenary.cases.run.recording import FIELD_EVERY, extent_of, recording_of
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.scene import Scene, problem_of
from catenary.meshgen.mesh import LineMesh
from catenary.postproc.files.committed_rows import ForceFilter
from catenary.postproc.files.header import Header
from catenary.postproc.files.own_files import RUN_FILE, remove_stale
from catenary.postproc.files.result_file import BEGUN_FOR, CHANGED, extend_run
from catenary.postproc.record.progress import Progress
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.record.run_watch import RunWatch, StripWatch
from catenary.postproc.record.snapshots.contents import RecordedLine
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.solver.problem.problem import OFF, Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest_on_all, refuse_lost_wire
from catenary.solver.time_loop.march import March, Outcome
from catenary.solver.time_loop.views.observers import Observer

if TYPE_CHECKING:
    from catenary.cases.run.excited_run import ExcitedRun

logger = logging.getLogger("catenary.runner")


class Phases:
    """Wall time of the phases of a run [s], each shown while it lasts, and also a PETSc log stage.

    Collective by use.
    """

    def __init__(self, progress: Progress) -> None:
        self.wall: dict[str, float] = {}
        self.progress = progress

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Time what happens inside."""
        begin = time.perf_counter()
        stage = PETSc.Log.Stage(name)
        stage.push()
        try:
            with self.progress.phase(name):
                yield
        finally:
            stage.pop()
            self.wall[name] = time.perf_counter() - begin


def performance(outcome: Outcome, phases: Phases, n_ranks: int) -> dict[str, Any]:
    """Times and counts of a run on ``n_ranks``, for its result file; after a restart those of its
    last part."""
    counted: dict[str, float] = dict(outcome.counters)
    if outcome.traffic is not None:
        # Of the rank that sends most; a whole number unless droppers of other ranks slacken.
        counted["messages_per_step"], counted["message_bytes_per_step"] = (
            round(value, 3) for value in outcome.traffic
        )
    return {
        "n_ranks": n_ranks,
        "march_wall_s": outcome.wall,
        "march_cpu_s": outcome.cpu,
        "records_wall_s": outcome.finishing,
        "phase_wall_s": phases.wall,
        "inner_iterations": counted,
        "detour": outcome.slow_path,
    }


@dataclass
class RunOutcome:
    """Result of a run.

    ``outcome`` is "done", "interrupted" or the sentence of what broke; ``summary`` the content of
    ``summary.json``; ``phase_wall`` the wall time of all phases, that of the report included [s].
    """

    outcome: str
    summary: dict[str, Any] = field(default_factory=dict)
    phase_wall: dict[str, float] = field(default_factory=dict)


def run_case(
    scene: Scene,
    out_dir: Path,
    comm: Any,
    *,
    force: bool = False,
    petsc_options: Sequence[str] = (),
    on_closed: Callable[[str], None] = lambda outcome: None,
    ready: Callable[[], None] = lambda: None,
    only_summary: bool = False,
    large: bool | None = None,
    excited: ExcitedRun | None = None,
) -> RunOutcome:
    """Simulate a scene and write results, fields and report into ``out_dir``. Collective.

    On several ranks a scene with a window is run on rank 0 alone.

    Parameters
    ----------
    scene : Scene, the same on all ranks
    force : whether results that are there may be replaced
    petsc_options : the options that PETSc was started with, for the record
    on_closed : called with the outcome on all ranks when the result file is closed, before the
        report is drawn: an MPI launcher that is interrupted leaves its processes a second
    ready : called on all ranks when folder and size of the run have been judged
    only_summary : write ``summary.json`` in place of the report, which costs no time
    large : whether a run may pass the bounds on its size; as ``force`` if not given
    excited : excitation that sets the line into motion in place of the scene's train

    Raises
    ------
    InputError
        If the line or an option of PETSc is impossible, if results are there already, if the
        folder cannot be written to or is another run's, or if the run is too large; nothing is
        written then.
    RunBroken
        If files cannot be written.
    """
    allowed = force if large is None else large

    def run(ranks: Any) -> RunOutcome:
        with held(out_dir, ranks, f"catenary run {scene.case.name}"):
            on_root(ranks, lambda: prepare(out_dir, force))
            return _Run(
                *(scene, out_dir, ranks, lambda size: check_size(out_dir, size, allowed)),
                *(petsc_options, on_closed, only_summary),
                ready=ready,
                excited=excited,
            ).make()

    return _on_as_many(scene, comm, run)


def restart_case(
    scene: Scene,
    out_dir: Path,
    comm: Any,
    *,
    petsc_options: Sequence[str] = (),
    on_closed: Callable[[str], None] = lambda outcome: None,
    force: bool = False,
    extends: bool = False,
    only_summary: bool = False,
) -> RunOutcome:
    """Continue an interrupted or broken run from its last checkpoint. Collective.

    ``scene`` must be the one that the run was started with; any number of ranks may continue.
    With ``extends`` it may have a later end and another evaluated stretch, and the run may be done.
    ``petsc_options``, ``on_closed`` and ``only_summary`` are those of ``run_case``; with ``force``
    the room on the disk is not looked at.

    Raises
    ------
    InputError
        If there is nothing to continue, if another process writes into the folder, or if there is
        no room for the rest.
    """
    from catenary.cases.run.continuing import state_to_continue

    def go_on(ranks: Any) -> RunOutcome:
        with held(out_dir, ranks, f"catenary restart {out_dir}"):
            state = on_root(ranks, lambda: state_to_continue(out_dir / RUN_FILE, extends))
            return _Run(
                *(scene, out_dir, ranks, lambda size: check_room_to_continue(out_dir, size, force)),
                *(petsc_options, on_closed, only_summary),
                state=state,
                extends=extends,
            ).make()

    return _on_as_many(scene, comm, go_on)


def _on_as_many(scene: Scene, comm: Any, run: Callable[[Any], RunOutcome]) -> RunOutcome:
    """The result of ``run`` on the ranks that a scene needs. Collective.

    With a window rank 0 runs alone, and the others sleep until it has finished: a step of some tens
    of spans takes less time than messages between ranks. Sleeping ranks ignore signals; an MPI
    launcher sends these to rank 0 as well.
    """
    if comm.size == 1 or scene.window.mode == OFF:
        return run(comm)

    if comm.rank == 0:
        _warn_of_idle(scene.window.mode, comm.size - 1)
    with StopRequest() if comm.rank else nullcontext():
        return on_root(comm, lambda: run(MPI.COMM_SELF), takes_long=True)


@cache  # once for many runs
def _warn_of_idle(mode: str, n_idle: int) -> None:
    logger.warning(
        "window.mode is %s: what moves is so short that one rank steps it; the other %d wait and "
        "make nothing faster, start it without mpirun",
        mode,
        n_idle,
    )


@dataclass
class _Run:
    """A run that is wanted in a folder that is ready: the arguments of ``run_case``, and the state
    that it continues from. ``judge`` sees its size on rank 0 before the mesh is made, or once that
    is read."""

    scene: Scene
    out_dir: Path
    comm: Any
    judge: Callable[[RunSize], None]
    petsc_options: Sequence[str]
    on_closed: Callable[[str], None]
    only_summary: bool
    ready: Callable[[], None] = lambda: None
    state: dict[str, Any] | None = None
    extends: bool = False
    excited: ExcitedRun | None = None
    problem: Problem = field(init=False)

    def __post_init__(self) -> None:
        self.result = self.out_dir / RUN_FILE
        self.phases = Phases(Progress(self.comm))

    def make(self) -> RunOutcome:
        """All phases. Collective."""
        outcome, n_unknowns = self._march()
        # The line is not needed any more: of a long one it is a gigabyte.
        give_back(n_unknowns)
        self.on_closed(outcome.outcome)
        with self.phases("report"):
            result = self._report(outcome)
        wall = result.phase_wall = dict(self.phases.wall)
        logger.debug("phases [s]: %s", {name: round(own, 3) for name, own in wall.items()})
        return result

    def _march(self) -> tuple[Outcome, int]:
        """End of the march, after which the result file is closed, and number of unknowns that the
        line had. Collective."""
        comm, phases, resume = self.comm, self.phases, self.state is not None
        left = f"{self.result} is as it was" if resume else "nothing was written"
        with ExitStack() as stack:
            with Phase(comm, "the line was read", left) as phase:
                excited = self.excited
                self.problem = problem_of(self.scene) if excited is None else excited.problem
                on_root(comm, phase.alone(self._judge_before_meshing))
                self.ready()
                at_rest = self._find_rest(phase)
                if excited is not None:
                    excited.excite(at_rest)
                else:
                    on_root(comm, lambda: refuse_lost_wire(at_rest.model, at_rest.form))
                header: Header | None = None
                if comm.rank == 0:
                    options = self.petsc_options
                    header = header_of(self.scene, self.problem, at_rest, options, excited)
                if resume:
                    on_root(comm, lambda: self._refuse_other_run(header, at_rest))
                phase.next("the solver was prepared")
                with phases("prepare solver"):
                    march = stack.enter_context(March(comm, *at_rest))
                    if self.state is not None:
                        march.restore(self.state)
                    if self.extends:
                        on_root(comm, lambda: self._extend(header, march.n_steps), takes_long=True)
                observers, recorder, watch = self._observers(at_rest, header, march.n_steps)
                header = None  # the recorder has it until it has written it
            give_back(at_rest.model.n_unknowns)
            with StopRequest() as stop:
                with phases("march"):
                    outcome = march.run(observers, stop)
                recorder.close(
                    {**performance(outcome, phases, comm.size), "watched": watch.facts()}
                )
        if not recorder.begun:
            raise RunBroken(outcome.outcome)
        return outcome, at_rest.model.n_unknowns

    def _judge_before_meshing(self) -> None:
        needs = needs_before_meshing(self.scene, self.problem)
        if needs is not None:
            self.judge(run_size(needs))

    def _find_rest(self, phase: Phase) -> LineAtRest:
        """Mesh and equilibrium, found on rank 0 and given to all. Collective."""

        def make_mesh() -> LineMesh:
            mesh = mesh_of(self.scene)
            if self.scene.mesh.file is not None:
                self.judge(run_size(needs_with_mesh(self.scene, mesh)))
            return mesh

        phase.next("the mesh was made")
        with self.phases("mesh"):
            mesh: LineMesh = on_root(self.comm, phase.alone(make_mesh), takes_long=True)
        phase.next("the equilibrium was found")
        with self.phases("equilibrium"):
            return line_at_rest_on_all(self.problem, mesh, self.comm, phase.alone)

    def _observers(
        self, at_rest: LineAtRest, header: Header | None, n_steps: int
    ) -> tuple[list[Observer], Recorder, RunWatch]:
        """Observers of the march, the recorder last, and the one that judges it. Not collective.

        The state to continue from, which the recorder writes, stands for all before it. ``n_steps``
        are those of the whole run, ``header`` is needed on rank 0.
        """
        comm, dt, output = self.comm, self.problem.numerics.dt, self.scene.output
        begun_for = comm.bcast(self._begun_for() if comm.rank == 0 else None) or n_steps
        excited, resume = self.excited, self.state is not None
        usual = FIELD_EVERY if excited is None else excited.snapshot_every
        extent, with_train = extent_of(at_rest.mesh), excited is None
        recording = recording_of(output, self.problem, extent, begun_for, usual, with_train)
        for sentence in recording.thinned(dt):
            logger.info(sentence)
        flush_every = output.flush_every_steps or flush_cadence(
            self.problem, at_rest.model.n_unknowns, recording
        )
        fields: FieldRecorder | None = None
        if recording.field_every:
            fields = FieldRecorder(
                comm,
                self.out_dir / "fields.xdmf",
                RecordedLine(
                    at_rest.problem.line, at_rest.mesh, at_rest.form.slope, at_rest.form.lateral
                ),
                every=recording.field_every,
                record=recording.fields,
                flush_every=flush_every,
                resume=resume,
                wait=True,
            )

        def begun() -> None:
            remove_stale(self.out_dir)
            if fields is not None:
                fields.publish()

        recorder = Recorder(
            comm,
            self.result,
            header,
            flush_every=flush_every,
            energy_every=recording.energy_every,
            record=recording.line,
            resume=resume,
            on_begun=begun,
            force_filter=lambda: _force_filter(dt) if with_train else None,
        )
        observers: list[Observer] = [] if fields is None else [fields]
        half_lengths = [place.data.strips.half_length for place in self.problem.train.placements]
        if "lateral_motion" in self.problem.effects and np.isfinite(half_lengths).any():
            observers.append(StripWatch(half_lengths))
        if excited is not None:
            observers += excited.watching(at_rest)
        watch = RunWatch(comm, at_rest, excited is None)
        return [*observers, self.phases.progress, watch, recorder], recorder, watch

    def _refuse_other_run(self, header: Header | None, at_rest: LineAtRest) -> None:
        from catenary.cases.run.continuing import refuse_other_run, refuse_other_state

        assert header is not None and self.state is not None
        n_strips = tuple(len(place.data.strips.offsets) for place in self.problem.train.placements)
        refuse_other_run(self.result, header, n_strips, CHANGED if self.extends else ())
        refuse_other_state(self.result, self.state, at_rest.model)

    def _extend(self, header: Header | None, n_steps: int) -> None:
        assert header is not None
        extend_run(self.result, header, n_steps)

    def _begun_for(self) -> int | None:
        """Steps for which a run was begun that got a later end, None if it did not."""
        if self.state is None:
            return None
        from catenary.postproc.read.results import Results

        with Results(self.result) as results:
            return results.attributes.get(BEGUN_FOR)

    def _report(self, outcome: Outcome) -> RunOutcome:
        """Write the report on rank 0. Collective.

        After an interruption the next signal ends the process, before one it leaves a whole result.
        """
        again = f"`catenary report {quote(str(self.out_dir))}` writes the report again"

        def work() -> RunOutcome:
            return self._write_report(outcome, again)

        if outcome.outcome != "done":
            return on_root(self.comm, work, takes_long=True)
        left = f"{self.result} is complete: {again}"
        with Phase(self.comm, "the report was written", left) as phase:
            return on_root(self.comm, phase.alone(work), takes_long=True)

    def _write_report(self, outcome: Outcome, again: str) -> RunOutcome:
        # On the rank that writes it, once the march is over: filters and pictures load for long.
        from catenary.postproc.report.report import write_report, write_summary

        try:
            if self.only_summary:
                write_summary(self.result, self.out_dir)
            else:
                write_report(self.result, self.out_dir)
            summary = json.loads((self.out_dir / "summary.json").read_text(encoding="utf-8"))
        except (OSError, CatenaryError) as error:
            if outcome.outcome != "done":  # reported already
                return RunOutcome(outcome.outcome)
            if not os.path.lexists(self.result):
                raise RunBroken(
                    f"{self.result} was moved or removed before its report was written; where it "
                    "is now, `catenary report` writes one"
                ) from error
            raise RunBroken(f"{error}; the results are complete: {again}") from error
        return RunOutcome(outcome.outcome, summary)


def _force_filter(dt: float) -> ForceFilter | None:
    """The filter of the contact force, None where steps are too long for it."""
    # Once the march is over: filters load for long.
    from catenary.postproc.evaluate import filters

    if 2.0 * filters.CUT_OFF * dt >= 1.0:
        return None
    return ForceFilter(filters.ABOUT, filters.low_pass)
