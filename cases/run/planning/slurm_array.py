"""A SLURM job array for a sweep or study: tasks make the runs, a last job makes the table.

Before the limit of its time SLURM sends a task SIGTERM; its runs then end with their next steps,
and the task asks to be started again, as SLURM does by itself after a lost node. What is done is
not run again. The last job begins when all tasks have ended; what none of them could do it does
itself.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from catenary.base.errors import InputError
from catenary.cases.run.planning.needs import NeedsOfRuns
from catenary.cases.run.planning.slurm_script import Job, after_dashes, directives_of


def array_script(
    words: Sequence[str],
    out: Path,
    job: Job,
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
    petsc_options : those after --

    Raises
    ------
    InputError
        If there are more tasks than runs, or what ``directives_of`` refuses.
    """
    if n_tasks > needs.n_runs:
        raise InputError(f"--array is {n_tasks}, more than the {needs.n_runs} runs")
    total, longest = needs.march
    march = max(longest, total / n_tasks / job.ranks)
    options = directives_of(job, out, march, needs.memory * job.ranks)
    return _SCRIPT.format(
        options="\n".join([f"#SBATCH --array=1-{n_tasks}", "#SBATCH --requeue", *options]),
        before="".join(f"{line}\n" for line in job.before),
        out=shlex.quote(str(out.absolute())),
        words=" ".join(map(shlex.quote, words)),
        petsc=after_dashes(petsc_options),
        ranks=job.ranks,
        n_tasks=n_tasks,
        chain=job.chain,
    )


_SCRIPT = """\
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
trap 'told=yes; kill -TERM "$program"' TERM
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
