"""The verb ``plan``: what a scene simulates, what that costs, and what each effect is worth."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import catenary
from catenary.base.errors import InputError
from catenary.cases.cli.app import (
    Force,
    Jobs,
    SceneWords,
    folder_option,
    print_findings,
    serial_verb,
)
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.studies.effect_cost.study import CostOptions

_RUNS = "runs"
_MOST_ROUNDS = 1000


@serial_verb(
    "plan",
    help="Print what a case simulates and what a run of it needs. With --cost, switch each effect "
    "in turn, and print the time of a step and the change of results.",
    epilog="Example: catenary plan ac_simple --set train.speed_km_h=320; "
    "catenary plan ambrosio2012 --cost --stretch-m 100 -o results/cost",
)
def plan(
    words: SceneWords,
    cost: Annotated[
        bool,
        typer.Option(
            "--cost", help="Measure what each effect costs and changes, on one rank; a minute."
        ),
    ] = False,
    only: Annotated[
        str | None,
        typer.Option("--only", metavar="EFFECT,...", help="With --cost: these effects alone."),
    ] = None,
    stretch: Annotated[
        float | None,
        typer.Option("--stretch-m", help="With --cost: length to evaluate at most; 200 if absent."),
    ] = None,
    rounds: Annotated[
        int | None,
        typer.Option("--rounds", help="With --cost: how often steps are timed; 10 if absent."),
    ] = None,
    tolerance: Annotated[
        str | None,
        typer.Option(
            "--tolerance",
            metavar="PERCENT",
            help="With --cost: smaller changes of results do not count; 1% if absent.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        folder_option("With --cost: folder for tables and runs; the same command reuses these."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="With --cost: print JSON in place of the table.")
    ] = False,
    n_jobs: Jobs = 1,
    force: Force = False,
) -> int:
    """Serial."""
    if cost:
        from catenary.cases.studies.accuracy.analysis import parse_target
        from catenary.cases.studies.effect_cost.study import CostOptions

        wanted = 0.01 if tolerance is None else parse_target(tolerance, "--tolerance") / 100
        options = CostOptions(
            words.case,
            words.changes,
            words.shortened,
            200.0 if stretch is None else _within("--stretch-m", stretch, 1.0, 1e7),
            10 if rounds is None else int(_within("--rounds", rounds, 1, _MOST_ROUNDS)),
            wanted,
            [] if only is None else [name.strip() for name in only.split(",")],
        )
        return _cost(options, out, as_json, n_jobs, force)
    belonging = {
        "--only": only, "--stretch-m": stretch, "--rounds": rounds, "--tolerance": tolerance,
        "-o": out, "--json": as_json or None, "--force": force or None,
        "-j": None if n_jobs == 1 else n_jobs,
    }  # fmt: skip
    for option, value in belonging.items():
        if value is not None:
            raise InputError(f"{option} belongs to plan --cost; give both")
    console.say(str(catenary.plan(words.scene())))
    return console.DONE


def _within(option: str, value: float, low: float, high: float) -> float:
    if not low <= value <= high:
        raise InputError(f"{option} {value:g} must be between {low:g} and {high:g}")
    return value


def _cost(options: CostOptions, out: Path | None, as_json: bool, n_jobs: int, force: bool) -> int:
    """Runs ``--cost``; returns the exit code."""
    from catenary.base.parallel import launched_by_mpirun
    from catenary.callers import temporary_folder
    from catenary.cases.process.petsc_options import as_arguments, start_petsc
    from catenary.cases.result_folder.output_folder import refuse_impossible, refuse_table
    from catenary.cases.scene.load import load_scene
    from catenary.cases.studies.records import held_study

    if launched_by_mpirun() and console.world().size > 1:
        raise InputError(
            f"plan --cost times steps on one rank, not on {console.world().size}: start it without "
            "mpirun"
        )
    if out is not None:
        refuse_impossible(out)
    scene = load_scene(options.case, options.overrides, options.shortened)
    comm = console.alone()
    start_petsc(as_arguments(scene.petsc.given(), []))
    from catenary.cases.studies.effect_cost import output, study

    def say(line: str) -> None:
        if not as_json:
            console.say(line)

    with ExitStack() as stack:
        held = stack.enter_context(held_study(out, comm, f"catenary plan {options.case} --cost"))
        if out is not None:
            refuse_table(out / output.RECORD, force)
        folder = out or stack.enter_context(temporary_folder(comm, "cost"))
        found = study.measure(options, folder / _RUNS, say, force, n_jobs)
        files = [] if found is None else held.write(lambda: output.files_of(found))
    if found is None:
        again = "" if out is None else "; the same command continues it"
        console.complain(f"interrupted before all effects were run{again}")
        return console.BROKEN
    if as_json:
        from catenary.postproc.report.study_table import json_text

        console.say(json_text(output.record_of(found)).rstrip(), whole=True)
    else:
        print_findings(output.as_text(found), files)
    return console.DONE
