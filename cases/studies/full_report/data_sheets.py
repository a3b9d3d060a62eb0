"""Data sheets of a run: its line to scale with wires and hardware, and its pantographs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.run.describe.pantographs import header_words
from catenary.cases.run.scene_mesh import line_figure
from catenary.cases.studies.full_report.scene_of_run import SceneOfRun
from catenary.mbs.lumped_data import LumpedData
from catenary.mbs.shape import HEAD, SPRING, shape_of
from catenary.meshgen.hardware import DropperKind
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.slowest_wave import slowest_wave_of
from catenary.meshgen.wires import Role, Wire
from catenary.postproc.evaluate.wording import stiffness_words, wire_words
from catenary.postproc.files.own_files import PICTURES
from catenary.postproc.report.pictures.figures import COLOURS, FewTicks, new_figure, own_style, tidy
from catenary.postproc.report.sections.section import EvaluatedRun, Picture, Section, Text, number
from catenary.postproc.report.study_table import StudyTable, texts_table
from catenary.solver.effects.all_effects import simulated
from catenary.solver.problem.problem import Placement, Problem
from catenary.solver.problem.wind import Wind
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.wind.wind_at import exposure

# Places along the track closer than this are one, contact wires whose heights differ less are met
# together [m].
_OFF, _ALIKE = 1e-6, 1e-3


def line(scene: SceneOfRun, run: EvaluatedRun) -> Section:
    """The line to scale, and what it is made of."""
    rest = scene.at_rest
    text = "The line at rest from the side and from above, and a cross-section."
    picture = Picture(
        "line", text, lambda: line_figure(scene.scene, scene.problem, rest.mesh, rest.form)[0]
    )
    return Section("Data sheet of the line", _line_blocks(scene.problem, rest), [picture])


def _line_blocks(problem: Problem, rest: LineAtRest) -> Iterator[StudyTable]:
    line, damping = problem.line, simulated(problem).damping
    rows, bending = [], _alike([wire.bending_stiffness for wire in line.wires])
    for wire, stiffness in zip(line.wires, bending, strict=True):
        alpha, beta = damping.per_component.get(wire.name, (damping.alpha, damping.beta))
        rows.append([
            wire_words(wire.name), wire.role.value, number(1e-3 * wire.tension, 2),
            number(wire.mass_per_length, 3), stiffness,
            number(None if wire.axial_stiffness is None else 1e-6 * wire.axial_stiffness, 2),
            number(slowest_wave_of(line, wire), 1), f"{alpha:.3g}", f"{beta:.3g}",
        ])  # fmt: skip
    heads = ["wire", "role", "tension [kN]", "mass [kg/m]", "EI [N m²]", "EA [MN]"]
    heads += ["wave speed [m/s]", "alpha [s]", "beta [1/s]"]
    note = "Damping C = alpha K + beta M."
    yield texts_table(heads, rows, set(range(2, len(heads))), "Wires", note)
    yield texts_table(["", "", ""], list(_geometry(rest, line)), {1}, "Geometry")
    hardware = list(_hardware(problem))
    if hardware:
        yield texts_table(["part", "number", "data"], hardware, {1}, "Hardware")
    wind = simulated(problem).wind
    if wind is not None:
        yield texts_table(["", "value", "unit"], list(_of_wind(wind)), {1}, "Wind")


def _geometry(rest: LineAtRest, line: Line) -> Iterator[list[Any]]:
    lengths = np.diff(line.support_positions)
    yield ["topology", line.topology, ""]
    yield ["spans", line.n_spans, ""]
    yield ["span length", _range(lengths, 2), "m"]
    yield ["length", number(float(np.ptp(line.support_positions)), 1), "m"]
    first, last = line.running_range
    masts = line.support_positions
    masts = masts[(masts > first + _OFF) & (masts < last - _OFF)]
    places = rest.mesh.points.copy()
    places[:, 2] = rest.form.height
    if rest.form.lateral is not None:
        places[:, 1] = rest.form.lateral.y
    # Of several contact wires the train meets the lowest, and twins that are as low.
    contact = _courses(rest.mesh, places, line.wires_of(Role.CONTACT), masts)
    height = np.nanmin(contact[:, 1], axis=0)
    y = contact[:, 0][contact[:, 1] <= height + _ALIKE]
    at = "at the supports of the running spans"
    yield [f"contact wire above the rail {at}", _range(height, 3), "m"]
    messengers = line.wires_of(Role.MESSENGER)
    if messengers:
        above = np.nanmin(_courses(rest.mesh, places, messengers, masts)[:, 1], axis=0) - height
        yield ["encumbrance there (messenger wire above contact wire)", _range(above, 3), "m"]
    if np.nanmax(np.abs(y), initial=0.0) > 0.0:
        yield ["stagger there, to the left", _range(y, 3), "m"]
    sag = max((max(own.sag, default=0.0) for own in line.profiles), default=0.0)
    if sag > 0.0:
        yield ["largest pre-sag wanted", number(1e3 * sag, 1), "mm"]


def _courses(
    mesh: LineMesh, places: np.ndarray, wires: Sequence[Wire], x: np.ndarray
) -> np.ndarray:
    """Lateral positions and heights of wires at rest, (wires, 2, n) [m], NaN where absent."""
    found = np.full((len(wires), 2, x.size), np.nan)
    for of_wire, wire in zip(found, wires, strict=True):
        for nodes in mesh.pieces(wire.name):
            own = places[nodes]
            there = (x >= own[0, 0] - _OFF) & (x <= own[-1, 0] + _OFF)
            for axis in (0, 1):
                of_wire[axis, there] = np.interp(x[there], own[:, 0], own[:, axis + 1])
    return found


def _hardware(problem: Problem) -> Iterator[list[Any]]:
    line = problem.line
    for group in line.droppers:
        joined = f"{wire_words(group.upper)} to {wire_words(group.lower)}"
        yield [f"droppers, {joined}", len(group.lower_x), _of_dropper(group.kind)]
    for arms in line.steady_arms:
        kind = arms.kind
        known = [
            (kind.length, f"{kind.length:g} m"),
            (kind.mass_per_length, f"{kind.mass_per_length:g} kg/m"),
            (kind.clamp_mass, f"clamp {kind.clamp_mass:g} kg"),
            (kind.by_radial_force, "vertical stiffness radial force over length"),
            (kind.stiffness, f"vertical stiffness {stiffness_words(kind.stiffness)}"),
        ]
        parts = [text for value, text in known if value]
        if kind.uplift_stop is not None:
            stop = (
                f"stop at {1e3 * kind.uplift_stop:g} mm with {stiffness_words(kind.stop_stiffness)}"
            )
            parts.append(stop)
        yield [f"steady arms on {wire_words(arms.wire)}", len(arms.x), ", ".join(parts)]
    for supports in line.supports:
        yield [
            f"supports of {wire_words(supports.wire)}",
            len(supports.x),
            f"stiffness {stiffness_words(supports.stiffness)}",
        ]
    for clamps in line.clamps:
        joined = f"{wire_words(clamps.upper)} to {wire_words(clamps.lower)}"
        held = f"stiffness {stiffness_words(clamps.stiffness)}, {clamps.mass:g} kg"
        yield [f"clamps, {joined}", len(clamps.x), held]
    for own in line.fittings:
        masses = _range(np.array(own.mass), 2)
        yield [f"{own.kind} on {wire_words(own.wire)}", len(own.x), f"{masses} kg"]


def _of_wind(wind: Wind) -> Iterator[list[Any]]:
    yield [f"mean speed {wind.reference_height:g} m above ground", number(wind.speed), "m/s"]
    yield ["blows, from the train's direction to the left", number(np.rad2deg(wind.direction)), "°"]
    law = wind.profile
    if law.exponent is None:
        yield ["roughness length of the logarithmic profile", f"{law.roughness:g}", "m"]
    else:
        yield ["exponent of the profile", f"{law.exponent:g}", ""]
    yield [f"mean speed at the wires, {wind.height:g} m above ground", number(wind.mean), "m/s"]
    for own in wind.stretches:
        there = wind.mean * exposure(wind, np.array([own.start]))[0]
        height = wind.height if own.height is None else own.height
        where = f"from {own.start:.6g} to {own.end:.6g} m, {height:g} m above ground"
        yield [f"the same {where}", number(there), "m/s"]
    yield ["density of the air", f"{wind.density:g}", "kg/m³"]
    if wind.gusts is not None:
        spectrum = wind.gusts.spectrum.replace("_", " ").title()
        yield [f"turbulence intensity, spectrum of {spectrum}", f"{wind.intensity:.3g}", ""]
        yield ["gusts, lowest frequency", f"{wind.gusts.lowest:g}", "Hz"]
        yield ["gusts, highest frequency", f"{wind.gusts.highest:g}", "Hz"]
        yield ["seed of the gusts", str(wind.gusts.seed), ""]


def _of_dropper(kind: DropperKind) -> str:
    if kind.stiffness is not None:
        data = f"stiffness {stiffness_words(kind.stiffness)}"
    elif kind.axial_stiffness is not None:
        data = f"EA {1e-3 * kind.axial_stiffness:g} kN"
    else:
        data = f"curve of {kind.n_pieces + 1} points"
    if kind.mass_per_length + kind.upper_clamp_mass + kind.lower_clamp_mass == 0.0:
        return f"{data}, massless"
    clamps = f"clamps {kind.upper_clamp_mass:g} kg above and {kind.lower_clamp_mass:g} kg below"
    return f"{data}, {kind.mass_per_length:g} kg/m, {clamps}"


def _range(values: np.ndarray, digits: int) -> str:
    values = values[np.isfinite(values)]
    if not values.size:
        return "–"
    low, high = (number(float(end), digits) for end in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def _alike(values: Sequence[float]) -> list[str]:
    """Figures of a column, with the decimals that the one with most of them has."""
    decimals = max(len(f"{value:.9g}".partition(".")[2]) for value in values)
    return [number(value, decimals) for value in values]


def _plain(name: str) -> str:
    return name.replace("_", " ")


def pantographs(scene: SceneOfRun, run: EvaluatedRun) -> Section:
    """Each kind of pantograph of the train: its data, and the pantograph drawn to scale."""
    kinds: dict[str, tuple[Placement, str]] = {}
    words = header_words(scene.scene, scene.problem)
    for placement, kind in zip(scene.problem.train.placements, words, strict=True):
        kinds.setdefault(kind["kind"], (placement, kind["description"]))
    pictures = []
    for file, (name, (placement, _)) in zip(PICTURES["pantographs"], kinds.items(), strict=False):
        how = "drawn to scale from its joints"
        if isinstance(placement.data, LumpedData):
            length = "assumed" if placement.data.strips.length is None else "to scale"
            how = "sketched from the side and from the front: "
            how += f"springs and arms are schematic, the strips' length is {length}"
        text = f"Pantograph {_plain(name)}, {how}."
        pictures.append(Picture(file, text, partial(_drawn, placement.data)))
    return Section("Data sheet of the pantographs", _pantograph_blocks(kinds), pictures)


def _pantograph_blocks(
    kinds: dict[str, tuple[Placement, str]],
) -> Iterator[Text | StudyTable]:
    for name, (placement, description) in kinds.items():
        yield Text(f"{description}.", "", f"{_plain(name)}:")
        data = placement.data
        if isinstance(data, LumpedData):
            columns = map(_alike, (data.masses, data.stiffnesses, data.dampings))
            rows = [
                [f"{n}{' (head)' if n == 1 else ''}", *own]
                for n, own in enumerate(zip(*columns, strict=True), start=1)
            ]
            heads = ["mass", "mass [kg]", "stiffness below [N/m]", "damping below [N s/m]"]
            yield texts_table(heads, rows, {1, 2, 3})
        else:
            rows = [[_plain(body.name), f"{body.mass:g}", *(f"{i:g}" for i in body.inertia)]
                    for body in data.system.bodies]  # fmt: skip
            heads = ["body", "mass [kg]", "Ixx [kg m²]", "Iyy [kg m²]", "Izz [kg m²]"]
            yield texts_table(heads, rows, {1, 2, 3, 4})
        strips = data.strips
        rows = [["collector strips", str(strips.number), ""]]
        if strips.number > 1:
            rows.append(["distance of the strips", number(strips.spacing, 3), "m"])
        if strips.length is not None:
            rows.append(["length of a strip", number(strips.length, 3), "m"])
        if strips.suspension is not None:
            own = strips.suspension
            rows += [
                ["mass of a strip", f"{own.mass:g}", "kg"],
                ["stiffness below a strip", f"{own.stiffness:g}", "N/m"],
                ["damping below a strip", f"{own.damping:g}", "N s/m"],
            ]
        yield texts_table(["head", "value", "unit"], rows, {1})


@own_style()
def _drawn(data: Any) -> Figure:
    """A pantograph from the side and from the front, heights above its base."""
    shape = shape_of(data)
    n_places = data.n_masses if isinstance(data, LumpedData) else 1
    rest = shape.pose(np.full(n_places, shape.below), 0.0, shape.below, shape.below).rest
    figure = new_figure(3.6)
    wide = np.ptp(rest[:, :2], axis=0) + 0.3  # both to one scale
    panels = figure.subplots(1, 2, sharey=True, width_ratios=wide.tolist())
    labels = "along the track [m]", "to the left [m]"
    for axes, across, label in zip(panels, (0, 1), labels, strict=True):
        for kind, (first, second) in zip(shape.kinds, shape.cells, strict=True):
            ends = rest[[first, second]]
            tone = COLOURS[1] if kind == HEAD else COLOURS[0] if kind == SPRING else "#222222"
            axes.plot(
                ends[:, across], ends[:, 2], color=tone, linewidth=2.2 if kind == HEAD else 1.3
            )
        axes.set_aspect("equal", adjustable="datalim")
        axes.xaxis.set_major_locator(FewTicks(4))
        tidy(axes, label, "height [m]" if across == 0 else "")
    return figure
