"""The full report of a run: data sheets, line to scale, worst places seen closely, validation.

It needs the scene that the run recorded, and shows what studies of the case measured: errors, and
costs of effects. Data sheets are those of the line, with wires and hardware, and of the
pantographs. The worst span, steady arm and dropper have candidates for why, and close views.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.run.description import header_words
from catenary.cases.run.scene_mesh import line_figure, mesh_of
from catenary.cases.scene.input.faults import Origin, shown
from catenary.cases.scene.load import recorded_scene, scene_from
from catenary.cases.scene.scene import Scene, problem_of, resolved
from catenary.cases.studies import effect_cost
from catenary.cases.studies.accuracy import output as accuracy
from catenary.cases.studies.accuracy.runs import physics_of
from catenary.cases.studies.questions.worst import (
    Causes,
    Passage,
    Spot,
    WorstPlaces,
    worst_of_each,
    worst_places,
)
from catenary.cases.studies.records import read_study
from catenary.cases.studies.reference.judgement import FAILED, NOT_JUDGED, readers_table
from catenary.cases.studies.reference.validation import VALIDATION
from catenary.cases.studies.sweep.sweep import differences
from catenary.mbs.lumped import LumpedData
from catenary.mbs.shape import HEAD, SPRING, shape_of
from catenary.meshgen.line import DropperKind, Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.slowest_wave import slowest_wave_of
from catenary.meshgen.wires import Role, Wire
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.wording import stiffness_words, wire_words
from catenary.postproc.files.header import in_sentence
from catenary.postproc.files.own_files import PICTURES
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import (
    EvaluatedRun,
    Folded,
    Picture,
    Section,
    SectionEntry,
    Text,
    number,
)
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.pictures.along_track import mark_line
from catenary.postproc.report.report import SECTIONS
from catenary.postproc.report.sections import dynamics, run_facts
from catenary.postproc.report.sections.run_facts import INPUT
from catenary.postproc.report.study_table import StudyTable, texts_table
from catenary.solver.effects.all_effects import active, registry, simulated
from catenary.solver.problem.problem import Placement, Problem
from catenary.solver.problem.wind import Wind
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.wind import exposure

# Columns of the study's table by the quantities that rule books judge.
_COLUMNS = {
    "mean_force": "error_mean_N",
    "force_std": "error_std_N",
    "force_max": "error_max_N",
    "force_min": "error_min_N",
    "arm_uplift": "error_uplift_mm",
}
# Places along the track closer than this are one, contact wires whose heights differ less are met
# together [m].
_OFF, _ALIKE = 1e-6, 1e-3
# Length that is shown beside a dropper and its extreme [m], and number of places in tables.
_BESIDE, _MOST = 30.0, 5
_HEADING = "Validation by EN 50318"
# Snapshots times length of the line [m] of a picture that is quickly drawn.
_LARGEST = 1e7


class SceneOfRun:
    """The scene that a run recorded, and its line at rest, which is computed.

    Attributes
    ----------
    scene, problem, at_rest : of the run
    has_train : whether a train excites the line

    Parameters
    ----------
    results : of the run, open

    Raises
    ------
    CatenaryError
        If the recorded scene is not one of this version, or its line has no rest.
    """

    def __init__(self, results: Results) -> None:
        self.scene = recorded_scene(results.attributes["config"], results.path)
        self.problem: Problem = problem_of(self.scene)
        self.at_rest: LineAtRest = line_at_rest(self.problem, mesh_of(self.scene))
        # A line that a force or a blow excites has no train, though its scene has.
        self.has_train = not results.attributes.get("excitation")

    @cached_property
    def input_text(self) -> str | None:
        """The scene as a case in TOML, without keys at their usual values.

        None if it would not make the run again: of a line without its train, or of a scene that
        does not load to the same one, as its files are gone.
        """
        if not self.has_train:
            return None
        plain = self.scene.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        # Effects that are on by default with their data need no key; those that are off have data.
        known, switched = registry(), self.scene.switches()
        plain["effects"] = {
            name: on for name, on in switched.items() if not (on and known[name].default)
        }
        try:
            if resolved(scene_from(plain, Origin(INPUT))) != resolved(self.scene):
                return None
        except InputError:
            return None
        return tomli_w.dumps(plain)


def measured_errors(scene: Scene, folder: Path) -> dict[str, float]:
    """Errors of quantities at the step and mesh of a scene, in their units. Not collective.

    Parameters
    ----------
    folder : of the study, which varied step and mesh together (axis ``grid``)

    Raises
    ------
    InputError
        If there is no such study, if it is of another case, or lacks the scene's step and mesh.
    """
    rows = _rows_of(folder / accuracy.RECORD, "catenary accuracy", scene)
    dt, elements = scene.numerics.dt_s, scene.mesh.elements_per_gap
    own = [
        row
        for row in rows
        if (row["outcome"], row["elements_per_gap"]) == ("done", elements)
        and abs((row["dt_s"] or 0.0) / dt - 1.0) < 1e-9
    ]
    if not own:
        raise InputError(
            f"{folder / accuracy.RECORD} has no run with a step of {1e3 * dt:g} ms and {elements} "
            "elements per gap, as this one has: vary both with --axes grid, without --quick"
        )
    known = {quantity: own[0][column] for quantity, column in _COLUMNS.items()}
    return {quantity: abs(error) for quantity, error in known.items() if error is not None}


def measured_costs(scene: SceneOfRun, folder: Path) -> dict[str, str]:
    """A sentence on what each effect costs and changes, by its name. Not collective.

    Parameters
    ----------
    folder : of `catenary plan CASE --cost -o FOLDER`

    Raises
    ------
    InputError
        If there is no such study, if it is of another case or of other effects.
    """
    path = folder / effect_cost.RECORD
    rows = _rows_of(path, "catenary plan --cost", scene.scene)
    on = {effect.name for effect in active(scene.problem)}
    found = {}
    for row in rows:
        name = row["effect"]
        if name and (row["simulated"] == effect_cost.LEFT_OUT) != (name in on):
            there, here = ("without", "with") if name in on else ("with", "without")
            raise InputError(f"{path} is a study {there} the effect {name}, the run is one {here}")
        if name:
            found[name] = row["advice"]
    return found


def _rows_of(path: Path, verb: str, scene: Scene) -> list[dict[str, Any]]:
    """The rows of the record of a study of a scene's case, and of no other scene if it has one."""
    record = read_study(path, verb)
    try:
        rows, case = list(record["rows"]), record["case"]
    except (KeyError, TypeError) as error:
        raise InputError(f"{path} is no record of `{verb}`: it has no rows of a case") from error
    if case != scene.case.name:
        raise InputError(f"{path} is a study of {case}, the run is one of {scene.case.name}")
    if record.get("scene"):
        for key, there, here in differences(record["scene"], physics_of(scene)):
            raise InputError(
                f"{path} is a study with {key} = {shown(there)}, the run is one with {shown(here)}"
            )
    return rows


def line_section(scene: SceneOfRun, run: EvaluatedRun) -> Section:
    """The line to scale, and what it is made of."""
    rest = scene.at_rest
    text = "The line at rest from the side and from above, and a cross-section."
    picture = Picture(
        "line", text, lambda: line_figure(scene.scene, scene.problem, rest.mesh, rest.form)[0]
    )
    return Section("Data sheet of the line", _line_blocks(scene.problem, rest), [picture])


def _line_blocks(problem: Problem, rest: LineAtRest) -> Iterator[StudyTable]:
    line, damping = problem.line, simulated(problem).damping
    rows, bending = [], _with_equal_decimals([wire.bending_stiffness for wire in line.wires])
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
        stop, held = kind.uplift_stop, stiffness_words(kind.stop_stiffness)
        known = [
            (kind.length, f"{kind.length:g} m"),
            (kind.mass_per_length, f"{kind.mass_per_length:g} kg/m"),
            (kind.clamp_mass, f"clamp {kind.clamp_mass:g} kg"),
            (kind.by_radial_force, "vertical stiffness radial force over length"),
            (kind.stiffness, f"vertical stiffness {stiffness_words(kind.stiffness)}"),
            (stop is not None, f"stop at {1e3 * (stop or 0.0):g} mm with {held}"),
        ]
        parts = ", ".join(text for value, text in known if value)
        yield [f"steady arms on {wire_words(arms.wire)}", len(arms.x), parts]
    for supports in line.supports:
        held = f"stiffness {stiffness_words(supports.stiffness)}"
        yield [f"supports of {wire_words(supports.wire)}", len(supports.x), held]
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


def _with_equal_decimals(values: Sequence[float]) -> list[str]:
    """Figures of a column, with the decimals that the one with most of them has."""
    decimals = max(len(f"{value:.9g}".partition(".")[2]) for value in values)
    return [number(value, decimals) for value in values]


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def _pantographs_section(scene: SceneOfRun, run: EvaluatedRun) -> Section:
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
        text = f"Pantograph {_spaced(name)}, {how}."
        pictures.append(Picture(file, text, partial(_draw_pantograph, placement.data)))
    return Section("Data sheet of the pantographs", _pantograph_blocks(kinds), pictures)


def _pantograph_blocks(kinds: dict[str, tuple[Placement, str]]) -> Iterator[Text | StudyTable]:
    for name, (placement, description) in kinds.items():
        yield Text(f"{description}.", "", f"{_spaced(name)}:")
        data = placement.data
        if isinstance(data, LumpedData):
            columns = map(_with_equal_decimals, (data.masses, data.stiffnesses, data.dampings))
            rows = [
                [f"{n}{' (head)' if n == 1 else ''}", *own]
                for n, own in enumerate(zip(*columns, strict=True), start=1)
            ]
            heads = ["mass", "mass [kg]", "stiffness below [N/m]", "damping below [N s/m]"]
            yield texts_table(heads, rows, {1, 2, 3})
        else:
            rows = [[_spaced(body.name), f"{body.mass:g}", *(f"{i:g}" for i in body.inertia)]
                    for body in data.system.bodies]  # fmt: skip
            heads = ["body", "mass [kg]", "Ixx [kg m²]", "Iyy [kg m²]", "Izz [kg m²]"]
            yield texts_table(heads, rows, {1, 2, 3, 4})
        strips, own = data.strips, data.strips.suspension
        head = [
            ("collector strips", str(strips.number), ""),
            ("distance of the strips", strips.number > 1 and number(strips.spacing, 3), "m"),
            ("length of a strip", strips.length is not None and number(strips.length, 3), "m"),
            ("mass of a strip", own and f"{own.mass:g}", "kg"),
            ("stiffness below a strip", own and f"{own.stiffness:g}", "N/m"),
            ("damping below a strip", own and f"{own.damping:g}", "N s/m"),
        ]
        known = [row for row in head if row[1]]
        yield texts_table(["head", "value", "unit"], known, {1})


@figures.own_style()
def _draw_pantograph(data: Any) -> Figure:
    """A pantograph from the side and from the front, heights above its base."""
    shape = shape_of(data)
    n_places = data.n_masses if isinstance(data, LumpedData) else 1
    rest = shape.pose(np.full(n_places, shape.below), 0.0, shape.below, shape.below).rest
    wide = np.ptp(rest[:, :2], axis=0) + 0.3  # both to one scale
    figure, panels = figures.panels(3.6, 1, 2, sharey=True, width_ratios=wide.tolist())
    labels = "along the track [m]", "to the left [m]"
    looks = {HEAD: (figures.COLOURS[1], 2.2), SPRING: (figures.COLOURS[0], 1.3)}
    for axes, across, label in zip(panels, (0, 1), labels, strict=True):
        for kind, cell in zip(shape.kinds, shape.cells, strict=True):
            ends, (tone, width) = rest[list(cell)], looks.get(kind, ("#222222", 1.3))
            axes.plot(ends[:, across], ends[:, 2], color=tone, linewidth=width)
        axes.set_aspect("equal", adjustable="datalim")
        axes.xaxis.set_major_locator(figures.FewTicks(4))
        figures.tidy(axes, label, "height [m]" if across == 0 else "")
    return figure


def _worst_section(scene: SceneOfRun | None, run: EvaluatedRun) -> Section:
    """The worst places of the evaluated stretch; without a scene nothing is known of the elasticity
    of the line and of gusts."""
    results, places = run.results, worst_places(run.results)
    causes = Causes(results, places.passages, None if scene is None else scene.at_rest)
    return Section(
        "Worst places", _worst_blocks(results, places, causes), _worst_pictures(results, places)
    )


def _worst_blocks(
    results: Results, places: WorstPlaces, causes: Causes
) -> Iterator[Text | StudyTable]:
    names = results.pantograph_names()
    for (noun, by), found in worst_of_each(places, causes, names, 1).items():
        for sentence, candidates in found:
            yield Text(f"{sentence}.", "note", f"Worst {noun} by {by}:", candidates)
    everywhere = causes.of_line()
    if everywhere:
        yield Text("acts on all spans alike:", "note", "The line as a whole", everywhere)
    yield Text(
        "A candidate for the cause is near in place or frequency; none is proved. `catenary worst "
        "FOLDER` prints them all."
    )
    rows = [
        [p.span + 1, f"{p.start:.6g} to {p.end:.6g}", names[p.pantograph], number(p.std),
         number(p.maximum), number(p.minimum), number(p.loss, 3)]
        for p in places.passages[:_MOST]
    ]  # fmt: skip
    heads = ["span", "from, to [m]", "pantograph", "sigma [N]", "max [N]", "min [N]", "loss [%]"]
    if rows:
        yield texts_table(heads, rows, {0, 3, 4, 5, 6}, "Spans by standard deviation")


def _worst_pictures(results: Results, places: WorstPlaces) -> Iterator[Picture]:
    if places.passages:
        passage = places.passages[0]
        who = results.pantograph_names()[passage.pantograph]
        text = (
            f"Contact force of {in_sentence(who)} in the worst span and the two beside it, and "
            "height of the contact wire above the rail."
        )
        yield Picture("worst_span", text, lambda: _draw_span(results, passage))
    for name, spots, what in (
        ("worst_dropper", places.forces, "Force of the dropper with the largest force"),
        ("longest_slack", places.slack, "Force of the dropper that is slack the longest"),
    ):
        for spot in spots[:1]:
            caption = f"{what}, {spot.place}, as the train passes."
            yield Picture(name, caption, partial(_draw_passage, results, spot))


@figures.own_style()
def _draw_span(results: Results, passage: Passage) -> Figure:
    """Contact force, and height of the contact point, in a span with those beside it."""
    length = passage.end - passage.start
    low, high = passage.start - length, passage.end + length
    p = passage.pantograph
    position = results.column("contact_position", p)
    rows = slice(*np.searchsorted(position, (low, high)).tolist())
    figure, (force, height) = figures.stacked(4.8, 2)
    raw = results.column("contact_force", p)
    filtered = filters.contact_force(results, p)[rows]
    for axes in (force, height):
        mark_line(axes, results, low, high, named=axes is force)
        label = "worst span" if axes is force else None
        axes.axvspan(passage.start, passage.end, color=figures.WORST, zorder=0.5, label=label)
    x = position[rows]
    light: dict[str, Any] = {"color": figures.colour(p), "alpha": 0.35, "linewidth": 0.7}
    force.plot(x, raw[rows], label="unfiltered", **light)
    force.plot(x, filtered, color=figures.colour(p), linewidth=1.6, label="20 Hz low-pass")
    for which, word, offset in ((np.argmax, "largest", (6, 4)), (np.argmin, "smallest", (6, -12))):
        within = np.flatnonzero((x >= passage.start) & (x <= passage.end))
        at = int(within[which(filtered[within])])
        force.annotate(
            f"{word} {filtered[at]:.0f} N at {x[at]:.1f} m", (x[at], filtered[at]),
            xytext=offset, textcoords="offset points", fontsize=8,
            bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0},
        )  # fmt: skip
        force.plot(x[at], filtered[at], "o", color=figures.LIMIT, ms=4)
    force.axhline(0.0, color=figures.LIMIT, linewidth=0.9)
    force.margins(y=0.25)  # for what is written at the extremes
    figures.tidy(force, "", "contact force [N]", legend=True)
    line = results.column("wire_height", p)[rows]
    height.plot(
        x, line, color=figures.COLOURS[2], linewidth=1.3, label="contact wire at the pantograph"
    )
    figures.tidy(
        height, "position of the pantograph along the track [m]", "height [m]", legend=True
    )
    return figure


@figures.own_style()
def _draw_passage(results: Results, spot: Spot) -> Figure:
    """Force of a dropper over the place of the leading pantograph."""
    leader = int(np.argmax(results.first_position))
    place = results.column("contact_position", leader)[:: results.line_record.every]
    behind = results.first_position[leader] - results.first_position
    most = place[int(np.nanargmax(results.column("dropper_force", spot.number)))]
    reach = min(spot.x, most) - _BESIDE, max(spot.x + float(behind.max()), most) + _BESIDE
    n_rows = results.n_rows("dropper_force")
    rows = slice(*np.clip(np.searchsorted(place, reach), 0, n_rows).tolist())
    force, x = results.column("dropper_force", spot.number, rows), place[rows] - spot.x
    figure, (axes,) = figures.stacked(3.0, 1)
    axes.plot(x, force, color="#222222", linewidth=1.4, label="force")
    for p, name in enumerate(results.pantograph_names()):
        label = f"{name} passes"
        axes.axvline(behind[p], color=figures.colour(p), linestyle="--", linewidth=1.1, label=label)
    slack = force <= 0.0
    if slack.any():
        axes.plot(x[slack], force[slack], ".", color=figures.LIMIT, ms=3, label="slack")
    axes.axhline(0.0, color="#6b6b6b", linewidth=0.7)
    axes.margins(x=0.0)
    who = "leading pantograph" if results.n_pantographs > 1 else "pantograph"
    figures.tidy(
        axes, f"position of the {who} relative to the dropper [m]", "dropper force [N]", legend=True
    )
    return figure


def statement_in(folder: Path) -> dict[str, Any]:
    """The statement that a folder of `catenary validate -o FOLDER` holds. Not collective.

    Returns ``installation``, ``steps``, ``figures`` and ``closing`` of its record.

    Raises
    ------
    InputError
        If there is no such statement.
    """
    path = folder / f"{VALIDATION}.json"
    found = read_study(path, "catenary validate")
    try:
        return {
            "installation": {
                key: str(found["installation"][key]) for key in ("program", "machine")
            },
            "steps": [(str(step["title"]), str(step["said"])) for step in found["steps"]],
            "figures": [row for row in found["figures"] if row["verdict"] != NOT_JUDGED],
            "closing": [str(text) for text in found["closing"]],
        }
    except (KeyError, TypeError) as error:
        raise InputError(f"{path} is no record of `catenary validate`: it is incomplete") from error


def _validation_section(statement: Mapping[str, Any] | None, run: EvaluatedRun) -> Section:
    """Validation of the program that made a run, by what ``statement_in`` found; None if no
    statement is at hand."""
    if statement is None:
        text = (
            "No validation of this installation is at hand. `catenary validate -o STUDY` goes "
            "through the steps of EN 50318; `catenary report --validation STUDY` shows them here."
        )
        return Section(_HEADING, [Text(text)])
    judged = statement["figures"]
    title = f"Judged figures ({len(judged)})"
    folded = [Folded(title, readers_table(judged, ""))] if judged else []
    return Section(_HEADING, _statement_blocks(statement, run), folded=folded)


def _statement_blocks(
    statement: Mapping[str, Any], run: EvaluatedRun
) -> Iterator[Text | StudyTable]:
    program, machine = statement["installation"].values()
    yield Text(f"Statement of {program} on {machine}.")
    made_by = " ".join(next(iter(run.results.attributes["versions"].items())))
    if program != made_by:
        yield Text(f"It is not one of the program of this run, {made_by}.", "remark")
    rows = [[number, *step] for number, step in enumerate(statement["steps"], start=1)]
    yield texts_table(["", "step", "result"], rows, {0})
    if failed := [row for row in statement["figures"] if row["verdict"] == FAILED]:
        yield readers_table(failed, "Figures beyond their limits")
    yield Text(" ".join(statement["closing"]))


def _waves_section(scene: SceneOfRun, run: EvaluatedRun) -> Section:
    """Motion of the contact wire in space and time, from the snapshots of the run."""
    # This section alone takes snapshots of a film, and the theory of waves.
    from catenary.cases.studies.waves import pictures
    from catenary.cases.studies.waves.seen import waves_seen
    from catenary.cases.studies.waves.theory import wave_theory
    from catenary.postproc.film.film_data import FilmData, Snapshots

    heading, results = "Waves in space and time", run.results
    try:
        data = FilmData(results)
        folder, until = results.path.parent, float(data.time[-1])
        with Snapshots(folder, len(data.points), until=until) as snapshots:
            snapshots.need_whole()
            size = len(snapshots.times) * float(np.ptp(data.points[:, 0]))
            if size > _LARGEST:
                raise InputError("the run is too long for it; catenary waves draws it")
            seen = waves_seen(data, snapshots)
        theory = wave_theory(scene.problem, scene.at_rest)
    except InputError as error:
        return Section(heading, [Text(f"There is no picture: {error}.")])
    supports = results.line("support_x")
    text = "Velocity of the lowest contact wire in space and time"
    moving = "force" if run.excitation else "pantographs"
    if seen.position.shape[1]:
        text += f", and the course of the {moving}"
    drawn = partial(pictures.space_time, seen, theory, supports, moving)
    picture = Picture("space_time", f"{text}.", drawn)
    return Section(heading, [], [picture])


def full_sections(
    scene: SceneOfRun | None,
    costs: tuple[Mapping[str, str], str] = ({}, ""),
    statement: Mapping[str, Any] | None = None,
) -> list[SectionEntry]:
    """The sections of a full report in their order.

    Parameters
    ----------
    scene : of the run; None leaves out what needs it
    costs : of its effects, as ``run_facts.effects`` takes them
    statement : of the installation, as ``_validation_section`` takes it
    """
    effects = SectionEntry("effects", partial(run_facts.effects, costs=costs))
    worst = partial(_worst_section, scene)
    behind = {"motion": [SectionEntry("worst", worst, dynamics.has_statistics, full=True)]}
    text = None
    if scene is not None:
        text = scene.input_text
        behind["spectrum"] = [SectionEntry("waves", partial(_waves_section, scene), full=True)]
        behind["rest"] = [SectionEntry("line", partial(line_section, scene), full=True)]
        if scene.has_train:
            sheet = partial(_pantographs_section, scene)
            behind["above"] = [SectionEntry("pantographs", sheet, full=True)]
    behind["run"] = [SectionEntry("validation", partial(_validation_section, statement), full=True)]
    last = SectionEntry("signatures", partial(run_facts.signatures, text), full=True)
    usual = [effects if entry.name == effects.name else entry for entry in SECTIONS]
    return [one for entry in usual for one in (entry, *behind.get(entry.name, ()))] + [last]
