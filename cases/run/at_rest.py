"""The line of a scene at rest: its tables, whether it is valid, temperatures, and for later steps.

Tables hold heights, droppers, registration and elasticity; those over temperatures tensions, ends
that move, and limits that the line keeps. A prepared line is stepped from outside, such as from C.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import catenary.solver.kernels
from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.run.arrivals import arrival_facts
from catenary.cases.run.description import defect_facts, kind_lines
from catenary.cases.run.scene_mesh import half_head_of, mesh_of
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.terminal.terminal_text import static_text
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import End
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.files.header import line_datasets, static_datasets
from catenary.postproc.read.registration import Registration
from catenary.postproc.report.study_table import json_text
from catenary.solver.effects.all_effects import with_defects
from catenary.solver.effects.effect import Limit
from catenary.solver.model.axial_motion import at_stop, tensioned_ends
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.problem import slowest_wave_speed
from catenary.solver.statics.form_finding import lengths_to_cut
from catenary.solver.statics.line_at_rest import (
    LineAtRest,
    LineAtTemperature,
    WireAtRest,
    line_at_rest,
    over_temperatures,
    refuse_lost_wire,
    stable_form,
)

_KERNELS = Path(catenary.solver.kernels.__path__[0])
# Header and library of C programs.
HEADER, LIBRARY = _KERNELS / "simulation/catenary.h", _KERNELS / "libcatenary.so"
# Limits of the change of tension: share, of what, and who states it.
_LIMITS = (
    (0.10, "largest", "10 % of TB 10009-2016, 5.4.7"),
    (0.11, "largest", "11 % for a half section (Kiessling et al., section 6)"),
    (0.08, "along", "8 % for the line alone (Kiessling et al., section 6)"),
    (0.03, "at_tensioners", "3 % for the tensioner (Kiessling et al., section 6)"),
)
# Shares that differ by less are one: a tensioner keeps to the edge of its band.
_ALIKE = 1e-6
_WHERE = {"largest": "", "along": " along the wire", "at_tensioners": " at its tensioner"}
# Steps between temperatures [K], of which a range has no more than so many.
_STEPS, _MOST_STEPS = (0.1, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0), 8
# Differences that a scene may have [K].
_LEAST, _MOST = -100.0, 150.0
_NEEDED = ("axial_motion", "temperature")
DROPPER_COLUMNS = ("dropper_span", "dropper_x", "dropper_length", "dropper_force")
DROPPER_WIRES = ("dropper_upper", "dropper_lower")
_DROPPER_HEADS = ("span", "x_m", "length_m", "force_N", "from_wire", "to_wire")


def rest_of(scene: Scene) -> LineAtRest:
    """The line of a scene at rest. Not collective."""
    return line_at_rest(problem_of(scene), mesh_of(scene))


def sound_rest(scene: Scene) -> LineAtRest:
    """The line of a scene at rest; InputError if a wire has lost its tension. Not collective."""
    found = rest_of(scene)
    refuse_lost_wire(found.model, found.form)
    return found


class Checked(NamedTuple):
    """Result of a check: sentences on line, pantographs and waves, and warnings."""

    sentences: list[str]
    warnings: list[str]


def check_line(scene: Scene) -> Checked:
    """Mesh and hang the line of a scene. Not collective.

    Raises
    ------
    InputError
        If the line is impossible: a dropper slack at rest, a wire that droppers cannot hold.
    """
    problem = problem_of(scene)
    mesh = mesh_of(scene)
    model, form = stable_form(problem, mesh)
    refuse_lost_wire(model, form)
    waves = arrival_facts(scene, problem)
    arms = _registration_of(mesh, form)
    sentences = [
        f"{scene.case.name} is valid: {counted(problem.line.n_spans, 'span')}, "
        f"{problem.line.support_positions[-1]:g} m, {counted(mesh.droppers.shape[0], 'dropper')}, "
        f"{mesh.n_nodes} nodes",
        *(
            f"pantograph {name}, " + "\n  ".join(lines)
            for name, lines in kind_lines(scene, problem).items()
        ),
        f"ends: {'; '.join(waves['ends'])}",
        *(fact["says"] for fact in waves["pantographs"]),
    ]
    pushed = [] if arms is None else arms.warnings()
    return Checked(sentences, [*waves["warnings"], *pushed, *_at_stops(model)])


def _at_stops(model: Model) -> list[str]:
    """A sentence if stops hold tensioners at rest, none if not."""
    ends = tensioned_ends(model)
    stopped = [end for end in ends if at_stop(model, end)]
    if not stopped:
        return []
    first = stopped[0]
    return [
        f"At rest stops hold {len(stopped)} of {counted(len(ends), 'tensioner')}, that of "
        f"{first.wire} at {model.mesh.points[first.node, 0]:g} m among them: these wires do not "
        f"have the tension of their weights, see {option('`catenary static`', 'catenary.static')}. "
        "Take a larger line.tensioner.travel_m, or a shorter section."
    ]


def _installed(line: Line, mesh: LineMesh, height: np.ndarray) -> dict[str, np.ndarray]:
    """Names of the wires that droppers join, ``line/dropper_upper`` and ``line/dropper_lower``
    (n_droppers,), and lengths along each piece of a wire whose ends are clamped,
    ``static/lengths/NAME`` [m], of a line at rest with ``height`` (n_nodes,) [m]."""
    group = mesh.dropper_group
    ends = (
        ("upper", [own.upper for own in line.droppers]),
        ("lower", [own.lower for own in line.droppers]),
    )
    found = {f"line/dropper_{end}": np.array(names, dtype=str)[group] for end, names in ends}
    for wire in line.wires:
        if all(End.CLAMPED in piece.ends for piece in wire.pieces):
            found[f"static/lengths/{wire.name}"] = np.array(
                [
                    np.hypot(np.diff(mesh.x(own)), np.diff(height[own])).sum()
                    for own in mesh.pieces(wire.name)
                ]
            )
    return found


def _registration_of(mesh: LineMesh, form: Equilibrium) -> Registration | None:
    """Steady arms at rest, None if wires do not move sideways, so that nothing pushes an arm."""
    if form.lateral is None:
        return None
    x, nodes = mesh.x(mesh.steady_arms), mesh.steady_arms
    return Registration(x, form.lateral.y[nodes], form.lateral.arm_force, form.lateral.arm_tension)


def static_table(scene: Scene) -> dict[str, np.ndarray]:
    """The line at rest, arrays named as in the result file's groups, and what `_installed` adds.

    Not collective.
    """
    problem = problem_of(scene)
    mesh = mesh_of(scene)
    rest = line_at_rest(problem, mesh)
    data = {
        **line_datasets(problem.line, mesh, problem.evaluation),
        "static/dropper_length": lengths_to_cut(problem, mesh),
        **static_datasets(rest.problem.line, mesh, rest.form, rest.lift),
        "line/dropper_x": mesh.x(mesh.droppers[:, 1]),
        "line/arm_x": mesh.x(mesh.steady_arms),
        **_installed(problem.line, mesh, rest.form.height),
    }
    return {name.split("/", 1)[1]: values for name, values in data.items()}


def rest_text(scene: Scene, table: Mapping[str, np.ndarray]) -> str:
    """Text of the table: defects, droppers, registration, sag and elasticity; of a line that is
    warmer than at its installation tensions along the section too. Not collective."""
    problem = problem_of(scene)
    defects = [fact["says"] for fact in defect_facts(scene, problem)]
    lines = [*defects, static_text(table, with_defects(problem).line, half_head_of(scene))]
    if problem.along.warmer and problem.effects.issuperset(_NEEDED):
        lines += ["", temperatures(scene, [problem.along.warmer], None)]
    return "\n".join(lines)


def write_static(path: Path, table: Mapping[str, Any], registration: bool = False) -> None:
    """Write the static table: the droppers as CSV, or the ``registration`` instead, or everything
    as JSON, by the file's suffix."""
    wires = [name.removeprefix("wires/") for name in table if name.startswith("wires/")]
    arms = Registration.of(table, wires) if registration else None
    if registration and arms is None:
        raise InputError("--registration: no steady arm pulls a wire sideways; give line.stagger_m")
    if path.suffix == ".json":
        text = json_text(table)
    elif arms is not None:
        text = arms.csv()
    else:
        columns = [np.asarray(table[name]) for name in (*DROPPER_COLUMNS, *DROPPER_WIRES)]
        rows = (
            (int(span) + 1, f"{x:.4f}", f"{length:.5f}", f"{force:.3f}", upper, lower)
            for span, x, length, force, upper, lower in zip(*columns, strict=True)
        )
        text = csv_text(_DROPPER_HEADS, rows)
    from catenary.postproc.files.disk import write_into  # loads HDF5

    write_into(path.parent, {path.name: text})


def temperatures(scene: Scene, differences: Sequence[float], picture: Path | None) -> str:
    """The table of a line over temperatures. Not collective.

    ``differences`` are those from the installation [K]; ``picture`` is a new file, or None.

    Raises
    ------
    InputError
        If the scene does not let its wires move along the track.
    RunBroken
        If the picture cannot be written.
    """
    switches = scene.switches()
    for name in _NEEDED:
        if not switches[name]:
            raise InputError(
                f"--temperatures needs effects.{name} = true, with what that needs of the scene; "
                f"it is off {scene.origin.of(f'effects.{name}')}"
            )
    problem, mesh = problem_of(scene), mesh_of(scene)
    rests = over_temperatures(problem, mesh, differences)
    if picture is not None:
        # Matplotlib takes long to import.
        from catenary.postproc.files.disk import write_into
        from catenary.postproc.report.pictures.figures import file_of
        from catenary.postproc.report.pictures.line_pictures import draw_temperatures

        drawn = file_of(draw_temperatures(rests), picture.name)
        write_into(picture.parent, {picture.name: drawn})
    return temperature_text(rests, problem.along.tensioner.ratio)


def range_of(text: str) -> list[float]:
    """The temperatures of "LOW,HIGH", differences from the installation (n,) [K].

    Raises
    ------
    InputError
        If the text is no ascending pair of numbers within what a scene may have.
    """
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"--temperatures {text!r} must be two numbers, such as -20,40: the lowest and the "
            "highest difference from the installation in K"
        ) from None
    if not _LEAST <= low < high <= _MOST:
        raise InputError(
            f"--temperatures {text} must ascend and lie between {_LEAST:g} and {_MOST:g} K"
        )
    step = next(step for step in _STEPS if high - low <= _MOST_STEPS * step)
    between = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)
    found: list[float] = np.unique(np.concatenate([[low], between, [high]])).tolist()
    return found


def temperature_text(rests: Sequence[LineAtTemperature], ratio: float) -> str:
    """The table over temperatures, and remarks on limits.

    Parameters
    ----------
    ratio : travel of the weights over that of the wire
    """
    lines = [
        f"{'dT [K]':>7} {'wire':22}{'least [N]':>10}{'most [N]':>10}{'along [%]':>10}"
        f"{'tensioner [%]':>14}{'end [mm]':>10}{'weights [mm]':>13}"
    ]
    for rest in rests:
        head = f"{rest.warmer:7g} "
        if rest.why_not:
            lines.append(f"{head}{rest.why_not}")
            continue
        for wire in rest.wires:
            if wire.ends:
                lines.append(head + _temperature_row(wire, ratio))
                head = " " * 8
    remarks = list(dict.fromkeys(_limit_remarks(rests)))
    if remarks:
        return "\n".join([*lines, "", *remarks])
    return "\n".join([*lines, "", "All changes of tension are within 10 %, and 8 % along a wire."])


def _temperature_row(wire: WireAtRest, ratio: float) -> str:
    moved = wire.moved[abs(wire.moved).argmax()]
    tensioned = any(end.tensioned for end in wire.ends)
    weights = f"{1e3 * ratio * moved:13.0f}" if tensioned else f"{'-':>13}"
    own = f"{100 * wire.at_tensioners:14.2f}" if tensioned else f"{'-':>14}"
    return (
        f"{wire.name:22}{wire.tension.min():10.0f}{wire.tension.max():10.0f}"
        f"{100 * wire.along:10.2f}{own}{1e3 * moved + 0.0:10.0f}{weights}"
    )


def _limit_remarks(rests: Sequence[LineAtTemperature]) -> Iterator[str]:
    """A sentence for each limit that a wire exceeds, at the temperature where it does so most."""
    names = dict.fromkeys(wire.name for rest in rests for wire in rest.wires)
    for name in names:
        own = [(rest.warmer, wire) for rest in rests for wire in rest.wires if wire.name == name]
        for limit, what, source in _LIMITS:
            warmer, worst = max(own, key=lambda at: getattr(at[1], what))
            value = getattr(worst, what)
            if value > limit + _ALIKE:
                yield (
                    f"{name}: at {warmer:+g} K the tension changes by {100 * value:.1f} %"
                    f"{_WHERE[what]}, more than {source}"
                )


def prepare_line(scene: Scene, path: Path) -> int:
    """Write the line of a scene with its train at rest; for how many steps. Not collective.

    Raises
    ------
    InputError
        If the line is impossible, or its steps need what a prepared line has not.
    RunBroken
        If the file cannot be written.
    """
    from catenary.base.mpi import MPI
    from catenary.solver.time_loop.march import March  # loads PETSc
    from catenary.solver.time_loop.prepared_line import write_line

    at_rest = sound_rest(scene)
    slower = scene.holds(Limit.WAVE_SPEED)
    below = slowest_wave_speed(at_rest.problem) if slower else inf
    with March(MPI.COMM_SELF, *at_rest) as march:
        return write_line(march, path, below)
