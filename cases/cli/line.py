"""The verbs ``check``, ``mesh``, ``static`` and ``prepare``: a scene's line, before any run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import catenary
from catenary.base.errors import InputError
from catenary.cases.cli.app import Force, SceneWords, serial_verb
from catenary.cases.result_folder.output_folder import new_file
from catenary.cases.terminal import console
from catenary.postproc.evaluate.wording import counted


@serial_verb(
    "check",
    help="Check a case without running it. It looks at keys, bounds, geometry, effects, mesh, "
    "pantographs, and whether a dropper is slack at rest; it writes nothing.",
    epilog="Example: catenary check my_line/case.toml --set line.dropper.pre_sag_mid_mm=60",
)
def check(
    words: SceneWords,
) -> int:
    """Serial."""
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


@serial_verb(
    "mesh",
    help="Write the mesh of a case, or draw its line to scale. The mesh is a Gmsh file; the "
    "drawing shows the line at rest.",
    epilog="Example: catenary mesh re330_stitched -o re330.svg",
)
def mesh(
    words: SceneWords,
    out: Annotated[
        Path,
        typer.Option(
            "-o",
            "--out",
            help="File to write: *.msh is the mesh; *.png and *.svg draw side view, plan view and "
            "a cross-section.",
        ),
    ],
    force: Force = False,
) -> None:
    """Serial."""
    scene = words.load()
    from catenary.cases.run.scene_mesh import DRAWN, draw_scene, write_mesh_of

    if out.suffix in DRAWN:
        first, last = draw_scene(scene, out, force)
        console.say(f"{out}: the line at rest from {first:g} to {last:g} m")
        return
    made = write_mesh_of(scene, out, force)
    console.say(f"{out}: {made.n_nodes} nodes, {counted(made.droppers.shape[0], 'dropper')}")


@serial_verb(
    "static",
    help="Print droppers, registration, sag, elasticity at rest.",
    epilog="Example: catenary static ac_simple -o droppers.csv",
)
def static(
    words: SceneWords,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            help="Also write a file: *.csv holds the dropper table, *.json everything; with "
            "--temperatures *.png and *.svg draw them.",
        ),
    ] = None,
    force: Force = False,
    registration: Annotated[
        bool,
        typer.Option("--registration", help="Write the table of the steady arms as *.csv."),
    ] = False,
    over: Annotated[
        str | None,
        typer.Option(
            "--temperatures",
            metavar="LOW,HIGH",
            help="Instead print tensions along the section and how far the ends of wires move, "
            "from LOW to HIGH K above the installation.",
        ),
    ] = None,
) -> None:
    """Serial."""
    if registration and (out is None or over is not None):
        raise InputError("--registration takes -o with the name of a *.csv file to write")
    if out is not None:
        tables = (".csv",) if registration else (".csv", ".json")
        new_file(out, tables if over is None else (".png", ".svg"), force)
    if over is not None:
        from catenary.cases.run.at_rest.temperatures import range_of, temperatures

        differences = range_of(over)
        console.say(temperatures(words.load(), differences, out))
        return
    rest = catenary.static(words.scene())
    if out is not None:
        from catenary.line_tables import write_rest

        write_rest(rest, out, registration)
    console.say(str(rest))


@serial_verb(
    "prepare",
    help="Write a line and its pantographs for steps from outside. A C program, a real-time "
    "computer or a controller in Python takes these steps.",
    epilog="Example: catenary prepare en50318_2002 -o en300.line --set train.speed_km_h=300",
)
def prepare(
    words: SceneWords,
    out: Annotated[Path, typer.Option("-o", "--out", help="File to write: *.line.")],
    force: Force = False,
) -> None:
    """Serial."""
    path = catenary.prepare(words.scene(), out, force=force)
    from catenary.cases.run.prepared import HEADER, LIBRARY

    with catenary.Simulation(path) as line:
        steps = f"{line.steps_left} steps of {line.dt * 1e3:g} ms"
    console.say(
        f"{out}: {steps}, {out.stat().st_size / 1e6:.0f} MB\n"
        f"C programs include {HEADER} and link {LIBRARY}; Python has catenary.Simulation"
    )
