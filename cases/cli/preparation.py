"""The verbs ``plan``, ``check``, ``mesh``, ``static`` and ``prepare``: a scene before any run.

``plan`` says what a scene simulates, what that costs, and what each effect is worth; the others
check, draw, print or write the scene's line.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import catenary
from catenary.base.errors import InputError
from catenary.base.parallel import launched_by_mpirun
from catenary.cases.cli.app import print_findings, serial_verb
from catenary.cases.cli.command_words import Force, Jobs, OutIfAny, SceneWords, names_in
from catenary.cases.result_folder.output_folder import new_file, refuse_impossible, refuse_table
from catenary.cases.terminal import console
from catenary.postproc.evaluate.wording import counted

if TYPE_CHECKING:
    from catenary.cases.studies.effect_cost import CostOptions

_RUNS = "runs"
_MOST_ROUNDS = 1000


@serial_verb("plan")
def plan(
    words: SceneWords,
    cost: bool = False,
    only: str | None = None,
    stretch_m: float | None = None,
    rounds: int | None = None,
    tolerance: str | None = None,
    out: OutIfAny = None,
    json: bool = False,
    n_jobs: Jobs = 1,
    force: Force = False,
) -> int:
    """Print what a case simulates and what a run of it needs.

    With --cost, switch each effect in turn, and print the time of a step and the change of results.

    Example: catenary plan ac_simple --set train.speed_km_h=320; catenary plan ambrosio2012 --cost
    --stretch-m 100 -o results/cost

    Parameters
    ----------
    cost : Measure what each effect costs and changes, on one rank; a minute.
    only EFFECT,... : With --cost: these effects alone.
    stretch_m : With --cost: length to evaluate at most; 200 if absent.
    rounds : With --cost: how often steps are timed; 10 if absent.
    tolerance PERCENT : With --cost: smaller changes of results do not count; 1% if absent.
    out : With --cost: folder for tables and runs; the same command reuses these.
    json : With --cost: print JSON in place of the table.
    """
    if cost:
        from catenary.cases.studies.accuracy.analysis import parse_target
        from catenary.cases.studies.effect_cost import CostOptions

        wanted = 0.01 if tolerance is None else parse_target(tolerance, "--tolerance") / 100
        options = CostOptions(
            words.case,
            words.changes,
            words.shortened,
            200.0 if stretch_m is None else _within("--stretch-m", stretch_m, 1.0, 1e7),
            10 if rounds is None else int(_within("--rounds", rounds, 1, _MOST_ROUNDS)),
            wanted,
            names_in(only),
        )
        return _cost(options, out, json, n_jobs, force)
    belonging = {
        "--only": only, "--stretch-m": stretch_m, "--rounds": rounds, "--tolerance": tolerance,
        "-o": out, "--json": json or None, "--force": force or None,
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
    from catenary.callers import given_or_temporary
    from catenary.cases.process.petsc_options import as_arguments, start_petsc
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
    from catenary.cases.studies import effect_cost

    def say(line: str) -> None:
        if not as_json:
            console.say(line)

    with (
        held_study(out, comm, f"catenary plan {options.case} --cost") as held,
        given_or_temporary(out, comm, "cost") as folder,
    ):
        refuse_table(out, effect_cost.RECORD, force)
        found = effect_cost.measure(options, folder / _RUNS, say, force, n_jobs)
        files = [] if found is None else held.write(lambda: effect_cost.files_of(found))
    if found is None:
        again = "" if out is None else "; the same command continues it"
        console.complain(f"interrupted before all effects were run{again}")
        return console.BROKEN
    if as_json:
        from catenary.postproc.report.study_table import json_text

        console.say(json_text(effect_cost.record_of(found)).rstrip(), whole=True)
    else:
        print_findings(effect_cost.as_text(found), files)
    return console.DONE


@serial_verb("check")
def check(words: SceneWords) -> int:
    """Check a case without running it.

    It looks at keys, bounds, geometry, effects, mesh, pantographs, and whether a dropper is slack
    at rest; it writes nothing.

    Example: catenary check my_line/case.toml --set line.dropper.pre_sag_mid_mm=60
    """
    from catenary.cases.scene.input.faults import SceneError

    try:
        scene = words.scene()
    except SceneError as error:
        for line in error.lines():
            console.complain(line)
        return console.BAD_INPUT
    warnings = catenary.check(scene)
    console.say("\n".join(warnings.sentences))
    for text in warnings:
        console.warn(text)
    return console.DONE


@serial_verb("mesh")
def mesh(words: SceneWords, out: Annotated[Path, "-o", "--out"], force: Force = False) -> None:
    """Write the mesh of a case, or draw its line to scale.

    The mesh is a Gmsh file; the drawing shows the line at rest.

    Example: catenary mesh re330_stitched -o re330.svg

    Parameters
    ----------
    out : File to write: *.msh is the mesh; *.png and *.svg draw side view, plan view and a
        cross-section.
    """
    scene = words.load()
    from catenary.cases.run.scene_mesh import DRAWN, draw_scene, write_mesh_of

    if out.suffix in DRAWN:
        first, last = draw_scene(scene, out, force)
        console.say(f"{out}: the line at rest from {first:g} to {last:g} m")
        return
    made = write_mesh_of(scene, out, force)
    console.say(f"{out}: {made.n_nodes} nodes, {counted(made.droppers.shape[0], 'dropper')}")


@serial_verb("static")
def static(
    words: SceneWords,
    out: Annotated[Path | None, "-o", "--out"] = None,
    force: Force = False,
    registration: bool = False,
    temperatures: str | None = None,
) -> None:
    """Print droppers, registration, sag, elasticity at rest.

    Example: catenary static ac_simple -o droppers.csv

    Parameters
    ----------
    out : Also write a file: *.csv holds the dropper table, *.json everything; with --temperatures
        *.png and *.svg draw them.
    registration : Write the table of the steady arms as *.csv.
    temperatures LOW,HIGH : Instead print tensions along the section and how far the ends of wires
        move, from LOW to HIGH K above the installation.
    """
    if registration and (out is None or temperatures is not None):
        raise InputError("--registration takes -o with the name of a *.csv file to write")
    if out is not None:
        tables = (".csv",) if registration else (".csv", ".json")
        new_file(out, tables if temperatures is None else (".png", ".svg"), force)
    if temperatures is not None:
        from catenary.cases.run import at_rest

        differences = at_rest.range_of(temperatures)
        console.say(at_rest.temperatures(words.load(), differences, out))
        return
    rest = catenary.static(words.scene())
    if out is not None:
        from catenary.line_tables import write_rest

        write_rest(rest, out, registration)
    console.say(str(rest))


@serial_verb("prepare")
def prepare(words: SceneWords, out: Annotated[Path, "-o", "--out"], force: Force = False) -> None:
    """Write a line and its pantographs for steps from outside.

    A C program, a real-time computer or a controller in Python takes these steps.

    Example: catenary prepare en50318_2002 -o en300.line --set train.speed_km_h=300

    Parameters
    ----------
    out : File to write: *.line.
    """
    path = catenary.prepare(words.scene(), out, force=force)
    from catenary.cases.run.at_rest import HEADER, LIBRARY

    with catenary.Simulation(path) as line:
        steps = f"{line.steps_left} steps of {line.dt * 1e3:g} ms"
    console.say(
        f"{out}: {steps}, {out.stat().st_size / 1e6:.0f} MB\n"
        f"C programs include {HEADER} and link {LIBRARY}; Python has catenary.Simulation"
    )
