"""A run on a cluster: time of a step on many ranks, and a SLURM script that starts the run.

**Time of a step.** A step on p ranks of a line of n unknowns, c [s] each, takes

    t(p) = t0 + c (n / p + 2 o) + 2 m(o) + log2(p) (m(share) + m(reply)),   p > 1,

with t0 for contacts, pantographs and steps taken one by one on rank 0, o unknowns of overlap to
each of two neighbours, m(k) = latency + k / bandwidth. Reductions and broadcasts run over a tree.

**The script** says how many ranks are taken, for how long, and which jobs go on. Before the limit
of its time SLURM sends a job SIGTERM; the run then ends with its next step, and the next job of the
chain continues it. The next job waits until this one has failed, which a lost node does as well;
SLURM takes it away when the run is done. Each knows the numbers of those before it, whose lock on
the folder it takes over.

Of a sweep or study a job array makes the runs, a last job the table. A task that SIGTERM comes to
asks to be started again, as SLURM does by itself after a lost node. What is done is not run again.
Its shell hands SIGTERM on as SIGUSR1: srun kills its ranks when SIGTERM comes to srun itself. The
last job begins when all tasks have ended; what none of them could do it does itself.
"""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from catenary.base.errors import InputError
from catenary.cases.result_folder.folder_lock import JOBS_ENDED
from catenary.cases.run.needs import Needs, NeedsOfRuns, needs_with_mesh
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.checks.mesh_size import STEP_OVERHEAD
from catenary.cases.scene.scene import Scene, problem_of
from catenary.solver.effects.build_model import numbering_of
from catenary.solver.problem.problem import Problem

# Bytes of a number; numbers before the answers in a share, before the forces in a reply, and links
# with their compensations that a reply has room for.
_BYTES, _FLAGS, _HEAD, _LINKS = 8, 4, 4, 32
# Time that a step takes longer by itself, as on several ranks, than in a block of steps: measured
# on lines of 25 to 1000 spans before and after there were blocks [s].
_ONE_BY_ONE = 1e-5
# Factor on the estimate of a job's time, the most that a start and a report take, and the
# least that a job asks for [s].
_SPARE, _AROUND, _LEAST = 3.0, 180.0, 600.0
# Time before its limit at which a job gets the signal to end: a step, a flush and the report [s].
NOTICE = 120
_GB = 1e9


class Wire(NamedTuple):
    """Time of a message: ``latency`` [s] and ``per_byte`` [s/B]."""

    latency: float
    per_byte: float

    def message(self, n_bytes: float) -> float:
        """Time of a message [s]."""
        return self.latency + n_bytes * self.per_byte


# Messages between nodes of a cluster, where they were not measured: 5 us and 5 GB/s, which today's
# networks do better. They decide by how much ranks of short lines wait for each other.
USUAL = Wire(5e-6, 2e-10)


class Sizes(NamedTuple):
    """Messages of a step [B]: to a neighbour, to rank 0 and back from there."""

    neighbour: int
    share: int
    reply: int


class Work(NamedTuple):
    """A step on one rank.

    Attributes
    ----------
    unknowns, spans : of the line
    step : time of a step on one rank [s]
    fixed : part of it that does not grow with the length of the line [s]
    sizes : of messages on several ranks
    """

    unknowns: int
    spans: int
    step: float
    fixed: float
    sizes: Sizes

    @property
    def overlap(self) -> float:
        """Unknowns that a rank solves for beyond its own to each side: about a span."""
        return self.unknowns / self.spans


class Predicted(NamedTuple):
    """A step on a number of ranks: whole, and its parts [s]."""

    ranks: int
    line: float
    neighbours: float
    tree: float
    fixed: float

    @property
    def step(self) -> float:
        """All of it [s]."""
        return self.line + self.neighbours + self.tree + self.fixed

    @property
    def messages(self) -> float:
        """Share of the messages [s]."""
        return self.neighbours + self.tree


def work_of(scene: Scene) -> Work:
    """Work of a step of a scene, whose mesh it makes. Not collective."""
    problem, mesh = problem_of(scene), mesh_of(scene)
    n_unknowns = numbering_of(problem, mesh).n_unknowns
    return _work_in(problem, needs_with_mesh(scene, mesh), n_unknowns)


def _work_in(problem: Problem, needs: Needs, n_unknowns: int) -> Work:
    """Work of a step of a problem: its time on one rank, by the estimate of ``catenary plan``, and
    its messages on several. Not collective."""
    n_spans = problem.line.n_spans
    contacts = sum(len(place.data.strips.offsets) for place in problem.train.placements)
    share = _FLAGS + 2 * contacts * (1 + contacts)
    reply = _HEAD + contacts + 2 * _LINKS
    sizes = Sizes(_BYTES * math.ceil(n_unknowns / n_spans), _BYTES * share, _BYTES * reply)
    step = needs.march / needs.n_steps
    return Work(n_unknowns, n_spans, step, min(STEP_OVERHEAD, step), sizes)


def predict(work: Work, wire: Wire, ranks: int) -> Predicted:
    """Predicted time of a step on ``ranks`` ranks, each with a core of its own.

    ``work`` is that of a step of the march, ``wire`` the cost of messages.
    """
    each = (work.step - work.fixed) / work.unknowns
    if ranks == 1:
        return Predicted(1, each * work.unknowns, 0.0, 0.0, work.fixed)
    sizes, levels = work.sizes, math.log2(ranks)
    return Predicted(
        ranks,
        each * (work.unknowns / ranks + 2.0 * work.overlap),
        2.0 * wire.message(sizes.neighbour),
        levels * (wire.message(sizes.share) + wire.message(sizes.reply)),
        work.fixed + _ONE_BY_ONE,
    )


def march_on(problem: Problem, needs: Needs, n_unknowns: int, ranks: int) -> float:
    """Predicted time of a march on ``ranks`` ranks, each with a core of its own [s].

    Not collective. A march with a window takes one rank, whatever their number.
    """
    if ranks == 1 or problem.window.moves:
        return needs.march
    return needs.n_steps * predict(_work_in(problem, needs, n_unknowns), USUAL, ranks).step


@dataclass(frozen=True)
class SlurmJob:
    """Request for a job.

    Attributes
    ----------
    ranks, nodes : of MPI, and computers that they are spread over
    minutes : limit of the job's time; None follows from the estimate
    chain : jobs that may follow the first one
    directives : further options of sbatch, such as ``--account=track``
    before : lines of shell before the run, such as ``module load catenary``
    signalled : "B:" if the shell of the script gets the signal of the limit, "" if its programs do
    a_node : ranks of the fullest node
    """

    ranks: int = 1
    nodes: int = 1
    minutes: int | None = None
    chain: int = 9
    directives: list[str] = field(default_factory=list)
    before: list[str] = field(default_factory=list)
    signalled: str = ""

    @property
    def a_node(self) -> int:
        return math.ceil(self.ranks / self.nodes)


def slurm_script(
    words: list[str],
    out: Path,
    job: SlurmJob,
    march_s: float,
    memory: float,
    petsc_options: list[str] | None = None,
) -> str:
    """The script of a run. Not collective.

    Parameters
    ----------
    words : arguments of ``catenary run`` but the folder
    out : folder of the results
    march_s : estimate of the march on all ranks of the job [s]
    memory : estimate of the node that takes most, beside libraries [B]
    petsc_options : options after --, which a job that continues the run takes as well

    Raises
    ------
    InputError
        If there are more nodes than ranks, or a directive is none.
    """
    return _SCRIPT.format(
        options="\n".join(["#SBATCH --no-requeue", *_directives_of(job, out, march_s, memory)]),
        before="".join(f"{line}\n" for line in job.before),
        out=shlex.quote(str(out.absolute())),
        words=" ".join(map(shlex.quote, words)),
        petsc=_after_dashes(petsc_options or []),
        chain=job.chain,
        ended=JOBS_ENDED,
    )


def _directives_of(job: SlurmJob, out: Path, march_s: float, memory: float) -> list[str]:
    """The lines for sbatch at the head of a script whose job takes the name of the folder ``out``;
    the march is estimated to take so long on all its ranks [s], and the node that takes most so
    much memory beside libraries [B]."""
    if job.nodes > job.ranks:
        raise InputError(f"--nodes is {job.nodes}, more than the {job.ranks} ranks of --ranks")
    for directive in job.directives:
        if not re.fullmatch(r"--?[A-Za-z][\w-]*([= ]\S+)?", directive):
            raise InputError(
                f"--sbatch is {directive!r}; it takes one option of sbatch, such as --account=NAME"
            )
    minutes = job.minutes or limit_minutes(march_s)
    name = re.sub(r"[^A-Za-z0-9_.-]", "_", f"catenary-{out.name or 'run'}")[:60]
    a_node = math.ceil((1.2 * memory + 0.3 * _GB * job.a_node) / _GB)
    options = [
        f"--job-name={name}",
        f"--nodes={job.nodes}",
        f"--ntasks={job.ranks}",
        f"--ntasks-per-node={job.a_node}",
        "--cpus-per-task=1",
        f"--mem={a_node}G",
        f"--time={minutes // 60:02d}:{minutes % 60:02d}:00",
        f"--signal={job.signalled}TERM@{NOTICE}",
        "--open-mode=append",
        *job.directives,
    ]
    return [f"#SBATCH {option}" for option in options]


def _after_dashes(petsc_options: Sequence[str]) -> str:
    """Options for PETSc as the end of a command of a shell."""
    return " " + " ".join(map(shlex.quote, ["--", *petsc_options])) if petsc_options else ""


def limit_minutes(march_s: float) -> int:
    """Limit of a job whose march is estimated to take so long [s], in steps of five minutes."""
    seconds = max(_LEAST, _SPARE * march_s + _AROUND + NOTICE)
    return 5 * math.ceil(seconds / 300.0)


_SCRIPT = """\
#!/bin/bash
{options}
# Written by `catenary submit`. Each job continues the run where the one before it ended.
set -u
out={out}
left=${{CATENARY_JOBS_LEFT:-{chain}}}
next=
if [ "$left" -gt 0 ]; then
    next=$(CATENARY_JOBS_LEFT=$((left - 1)) {ended}="${{{ended}:-}} $SLURM_JOB_ID" \\
        sbatch --parsable --export=ALL --kill-on-invalid-dep=yes \\
        --dependency="afternotok:$SLURM_JOB_ID" "$0")
fi
{before}\
if [ -f "$out/run.h5" ]; then
    srun catenary restart "$out"{petsc}
else
    srun catenary run {words} -o "$out"{petsc}
fi
code=$?
# The next job is for a run that was interrupted or killed. Others would end the same way again: bad
# input, a run that never began, or one that broke.
broken() {{
    [ ! -f "$out/run.h5" ] ||
        grep -s '"outcome": ' "$out/summary.json" | grep -qv '"interrupted"'
}}
if [ -n "$next" ] && [ "$code" -lt 128 ] && {{ [ "$code" -eq 2 ] || broken; }}; then
    scancel "${{next%%;*}}"  # of several clusters sbatch prints the name as well
fi
exit "$code"
"""


def array_script(
    words: Sequence[str],
    out: Path,
    job: SlurmJob,
    n_tasks: int,
    needs: NeedsOfRuns,
    petsc_options: Sequence[str] = (),
) -> str:
    """The script of all tasks and of the last job. Not collective.

    Parameters
    ----------
    words : verb and arguments of ``catenary`` but the folder
    out : folder of the results
    job : ``ranks`` of a task, a run on each at the same time; ``chain``, how often a task may be
        started again
    n_tasks : tasks that make runs
    petsc_options : options after --

    Raises
    ------
    InputError
        If there are more tasks than runs, or what ``_directives_of`` refuses.
    """
    if n_tasks > needs.n_runs:
        raise InputError(f"--array is {n_tasks}, more than the {needs.n_runs} runs")
    total, longest = needs.march
    march = max(longest, total / n_tasks / job.ranks)
    options = _directives_of(job, out, march, needs.memory * job.a_node)
    return _ARRAY_SCRIPT.format(
        options="\n".join([f"#SBATCH --array=1-{n_tasks}", "#SBATCH --requeue", *options]),
        before="".join(f"{line}\n" for line in job.before),
        out=shlex.quote(str(out.absolute())),
        words=" ".join(map(shlex.quote, words)),
        petsc=_after_dashes(petsc_options),
        ranks=job.ranks,
        n_tasks=n_tasks,
        chain=job.chain,
    )


_ARRAY_SCRIPT = """\
#!/bin/bash
{options}
# Written by `catenary submit --array`. Tasks 1 to {n_tasks} make a part of the runs each. The last
# job, task 0 of an array of its own, makes what they left and the table:
#     id=$(sbatch --parsable job.sh) && sbatch --array=0 --dependency=afterany:$id job.sh
set -u
out={out}
part=
[ "$SLURM_ARRAY_TASK_ID" -eq 0 ] || part="--part=$SLURM_ARRAY_TASK_ID/{n_tasks}"
{before}\
told=
# srun hands SIGUSR1 on to the runs, and kills them if it gets SIGTERM itself.
trap 'told=yes; kill -USR1 "$program"' TERM
srun catenary {words} -o "$out" -j {ranks} $part{petsc} &
program=$!
wait "$program"
code=$?
# A signal ends the first wait before the program has ended.
[ -z "$told" ] || {{ wait "$program"; code=$?; }}
if [ -n "$told" ] && [ "$code" -ne 0 ] && [ "${{SLURM_RESTART_COUNT:-0}}" -lt {chain} ]; then
    scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
fi
exit "$code"
"""
