"""The waves of a run: pictures of what is seen, and figures and bands of what theory says.

Something other than its train may set a line into motion, which is then marched and seen. The train
stands aside: one mass that nothing lifts, under a contact without stiffness. All else is the line's
own, droppers that slacken included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.base.mpi import MPI
from catenary.base.options import flag_of
from catenary.cases.result_folder.output_folder import refuse_earlier, refuse_table
from catenary.cases.run.excited_run import ExcitedRun
from catenary.cases.run.runner import run_case
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.load import recorded_scene
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.studies.asked import Excited
from catenary.cases.studies.waves import obstacles, pictures
from catenary.cases.studies.waves.seen import (
    EnergyMotion,
    EnergySeen,
    TakesMotion,
    WavesSeen,
    WireMotion,
    course_of,
    measured_rows,
    places_of,
    transmitted,
    waves_seen,
)
from catenary.cases.studies.waves.theory import (
    WaveTheory,
    curve_rows,
    draw_reflections,
    reflection_rows,
    reflections_of,
    row_of,
    wave_theory,
)
from catenary.mbs.lumped import LumpedData
from catenary.meshgen.slowest_wave import bends, slowest_wave_of
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.evaluate.remarks import all_remarks
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.postproc.read.guard import examined
from catenary.postproc.read.results import Results
from catenary.postproc.report.study_table import Content, write_files
from catenary.solver.contact_problem.coupling import DIVERGED
from catenary.solver.effects.all_effects import move_together
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import BOUNDED, Placement, Problem, Train
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView
from catenary.solver.waves.excitation import (
    FORCE,
    HAMMER,
    PULSE,
    Blow,
    Excitation,
    MovingForce,
    hammer,
)

# A whole (1 - cosine) / 2 of 0.1 s has most of its waves below 20 Hz, half a sine of 0.02 s below
# 75 Hz [s].
DURATIONS = {PULSE: 0.1, HAMMER: 0.02}
# Impulse of a hammer [N s].
IMPULSE = 10.0
_ASIDE = LumpedData((8.0,), (0.0,), (0.0,))


# Kinds that take a setting.
_KINDS = {
    "force": (FORCE, PULSE),
    "frequency": (FORCE,),
    "at": (PULSE, HAMMER),
    "duration": (PULSE, HAMMER),
    "impulse": (HAMMER,),
}
Row = dict[str, Any]
TABLE, OBSTACLES = "waves.csv", "obstacles.csv"
# Snapshots that show waves up to 20 Hz, and five of them a period at 20 Hz [s].
SNAPSHOT_EVERY = 0.01
# Of a blow, whose waves are shorter [s].
BLOW_EVERY = 0.004
# Length of line that is shown behind and ahead of the train [m].
_BEHIND, _AHEAD = 300.0, 200.0


def study_waves(folder: Path) -> tuple[str, list[Path]]:
    """Write pictures and tables of the waves into a run's folder; a text for terminals, and the
    files. Not collective.

    Raises
    ------
    InputError
        If there is no run with snapshots, or nothing can be written.
    """
    with Results(folder, examined(folder)) as results:
        data = FilmData(results)
        with Snapshots(folder, len(data.points), until=float(data.time[-1])) as snapshots:
            snapshots.need_whole()
            scene = recorded_scene(results.attributes["config"], folder)
            problem = problem_of(scene)
            rest = line_at_rest(problem, mesh_of(scene))
            numbers = np.empty(rest.mesh.n_nodes, dtype=np.int64)  # of the nodes in the run
            for name, nodes in rest.mesh.wires.items():
                numbers[nodes] = data.wires[name]
            if {"u", "v"} & set(rest.model.unknowns) and not snapshots.has_vectors:
                raise InputError(
                    f"{folder / 'fields.h5'} has the uplift alone, and the energy of this line is "
                    'that of all its motions; run the scene again with "displacement" in '
                    "output.fields"
                )
            energy = EnergyMotion(rest, numbers)
            seen = waves_seen(data, snapshots, [energy.add])
            ends = np.array([snapshots.moving(n) for n in range(snapshots.times.size)])
            moving = np.column_stack(
                [np.maximum(ends[1:, 0], ends[:-1, 0]), np.minimum(ends[1:, 1], ends[:-1, 1])]
            )
        remarks = all_remarks(results, indicate(results))
    theory = wave_theory(problem, rest)
    what = "train"
    if data.excitation is not None:
        what = "force" if isinstance(data.excitation, MovingForce) else "blow"
    waves = energy.seen().within(moving)
    return _write_waves(folder, theory, rest, seen, waves, data.supports, what, remarks)


def study_excited(
    scene: Scene, kind: str, settings: Excited, folder: Path, force: bool
) -> tuple[str, list[Path]]:
    """Run a line without its train under an excitation, and write the waves that are seen; a text
    for terminals, and the files. Serial.

    The folder then has the files of a run.

    Parameters
    ----------
    scene : checked scene of the line
    kind : of the excitation, see `excitation.KINDS`
    settings : of the excitation
    folder : new, or empty, unless ``force`` is given
    force : whether earlier results there are replaced

    Raises
    ------
    InputError
        If a setting is impossible, or the folder is not empty.
    RunBroken
        If the march breaks.
    """
    problem = problem_of(scene)
    excitation = excitation_of(kind, settings, problem, problem.numerics.dt)
    refuse_earlier(folder, force)
    refuse_table(folder, TABLE, force)
    moves = isinstance(excitation, MovingForce)
    every = SNAPSHOT_EVERY if moves else BLOW_EVERY
    found: list[tuple[LineAtRest, WireMotion, EnergyMotion]] = []

    def watching(rest: LineAtRest) -> list[Observer]:
        wire = WireMotion(rest.model.contact_nodes, rest.model.contact_x)
        energy = EnergyMotion(rest)
        found.append((rest, wire, energy))
        return [Watch(max(1, round(every / problem.numerics.dt)), [wire.add, energy.add])]

    run = ExcitedRun(without_train(problem, excitation), excitation, every, watching)
    ended = run_case(scene, folder, MPI.COMM_SELF, force=force, only_summary=True, excited=run)
    if ended.outcome != "done":
        raise RunBroken(ended.outcome)
    ((rest, wire, energy),) = found
    theory = wave_theory(problem, rest)
    supports = problem.line.support_positions[1:-1]
    what = "force" if moves else "blow"
    seen = wire.seen(*course_of(excitation))
    remarks = ended.summary["remarks"]
    return _write_waves(folder, theory, rest, seen, energy.seen(), supports, what, remarks)


def study_obstacles(scene: Scene, folder: Path, force: bool) -> tuple[str, list[Path]]:
    """Measure the obstacles of a scene's line; a text for terminals, and the files. Serial.

    Raises
    ------
    InputError
        If the folder holds such a table and ``force`` is not given, or if a wire is carried by its
        bending.
    """
    refuse_table(folder, OBSTACLES, force)
    problem = problem_of(scene)
    for wire in problem.line.wires:
        if bends(slowest_wave_of(problem.line, wire), wire.tension, wire.mass_per_length):
            raise InputError(
                f"--obstacles measures wires under tension; {wire.name} carries waves by bending, "
                "whose speeds are too different for a window in time to part what comes from what "
                "goes back"
            )
    rest = line_at_rest(problem, mesh_of(scene))
    results = [obstacles.result_of(one, problem) for one in obstacles.obstacles_of(rest)]
    lines = [
        f"{one.name.replace('_', ' ')}: measured within {100.0 * one.error.max():.2g} % of theory"
        for one in results
    ]
    files = write_files(
        folder,
        {
            OBSTACLES: obstacles.as_rows(results),
            "obstacles.png": lambda: obstacles.picture(results),
        },
    )
    return "\n".join(lines), files


def _write_waves(
    folder: Path,
    theory: WaveTheory,
    rest: LineAtRest,
    seen: WavesSeen,
    energy: EnergySeen,
    supports: np.ndarray,
    what: str,
    remarks: list[str],
) -> tuple[str, list[Path]]:
    """Text, and pictures of the waves that are seen, and tables with theory beside them."""
    moving, origin = ("pantographs", "first pantograph") if what == "train" else (what, what)
    until = min((incident.time for incident in rest.model.simulated.incidents), default=np.inf)
    if until < energy.time[-1]:
        energy = energy.until(until)
        remarks = [*remarks, f"Energies end at {until:g} s, when an incident changes the line."]
    reflections, spectra = reflections_of(rest), transmitted(theory, seen)
    measured = [
        *measured_rows(theory, seen, spectra), *reflection_rows(reflections, theory.speed)
    ]  # fmt: skip
    content: dict[str, Content] = {
        "energy.csv": _energy_rows(energy, seen) if energy.time.size > 1 else [],
        TABLE: [*as_rows(theory), *measured],
        "pass_bands.csv": _band_rows(theory),
        "space_time.png": lambda: pictures.space_time(seen, theory, supports, moving),
        "wavenumbers.png": lambda: pictures.wavenumbers(seen, theory, what),
        "energy.png": lambda: (
            pictures.energy_parts(energy, seen, origin) if energy.time.size > 1 else None
        ),
    }
    if reflections:
        both = rest.problem.ends
        content["end_reflection.png"] = lambda: draw_reflections(reflections, both, theory.speed)
        content["end_reflection.csv"] = curve_rows(reflections)
    if spectra is not None:
        content["transmission.png"] = lambda: pictures.transmission(spectra)
    if seen.position.shape[1]:
        content["train_frame.png"] = lambda: pictures.train_frame(
            seen, theory, _BEHIND, _AHEAD, origin
        )
    return _as_text(theory, measured, remarks), write_files(folder, content)


def _energy_rows(energy: EnergySeen, seen: WavesSeen) -> list[Row]:
    """Energy of the line over time [J]: behind, between and ahead of the moving sources.

    ``seen`` has the places of the pantographs or of a moving force, or the place of a blow.
    """
    behind, between, ahead = energy.parts(places_of(seen, energy.time))
    columns = energy.time, behind, between, ahead, behind + between + ahead
    names = ("time_s", "behind_J", "between_J", "ahead_J", "total_J")
    return [dict(zip(names, row, strict=True)) for row in np.column_stack(columns).tolist()]


def as_rows(theory: WaveTheory) -> list[Row]:
    """Figures with unit and meaning; those that the line does not have are left out."""
    of_string = "" if theory.by_bending else ", sqrt(T / m)"
    fastest, at = (np.nan, np.nan) if theory.bloch is None else theory.bloch.fastest(20.0)
    rows = [
        ("train_speed", theory.speed, "m/s", "speed of the train"),
        ("wave_speed", theory.wave_speed, "m/s", f"slowest wave of the contact wire{of_string}"),
        ("doppler_factor", theory.doppler, "-",
         "Doppler factor of an echo from ahead, (c - v) / (c + v)"),
        ("dropper_reflection", theory.reflection, "-",
         "reflection coefficient of a stiff dropper on the contact wire, Z_m / (Z_c + Z_m)"),
        ("amplification", theory.amplification, "-", "amplification of a wave between head and "
         "dropper, reflection coefficient / Doppler factor"),
        ("fastest_group_velocity", fastest, "m/s",
         "greatest group velocity of the periodic line up to 20 Hz"),
        ("frequency_of_the_fastest", at, "Hz",
         "frequency of the wave with the greatest group velocity"),
    ]  # fmt: skip
    return [row_of(*row) for row in rows if np.isfinite(row[1])]


def _band_rows(theory: WaveTheory) -> list[Row]:
    """Pass bands of the periodic line, and ranges that outrun the train [Hz]."""
    found = {"pass band": theory.bands(), "outruns the train": theory.outrunning()}
    return [
        {"what": what, "from_Hz": float(low), "to_Hz": float(high)}
        for what, bands in found.items()
        for low, high in bands
    ]


def _as_text(theory: WaveTheory, measured: list[Row], remarks: Sequence[str]) -> str:
    """Figures of theory and ``measured`` ones for a terminal, and ``remarks`` on the run that shows
    the waves."""
    rows = [*as_rows(theory), *measured]
    units = {"-": ""}
    lines = [
        f"{row['meaning']}: {row['value']:.4g} {units.get(row['unit'], row['unit'])}".rstrip()
        for row in rows
    ]
    for what, bands in (
        ("Pass bands", theory.bands()),
        ("Faster than the train", theory.outrunning()),
    ):
        text = ", ".join(f"{low:.2f}-{high:.2f}" for low, high in bands)
        if text:
            lines.append(f"{what}: {text} Hz")
    if theory.why_not:
        lines.append(f"No pass bands: {theory.why_not}")
    return "\n".join([*lines, *(f"REMARK      {text}" for text in remarks)])


def excitation_of(kind: str, settings: Excited, problem: Problem, dt: float) -> Excitation:
    """The excitation of a kind on the line of a problem.

    Parameters
    ----------
    kind : one of `excitation.KINDS`
    settings : of the excitation
    problem : with the line and its train
    dt : time step, which a blow lasts ten times at least [s]

    Raises
    ------
    InputError
        If something asked for is none of the kind's, or out of range, or if twin wires move as one.
    """
    _refuse_settings(kind, settings)
    if move_together(problem):
        raise InputError(
            f"--excite {kind} acts on one of two contact wires, which move as one without "
            "effects.relative_motion: switch that on"
        )
    if kind == FORCE:
        return _moving_force(settings, problem, dt)
    return _blow(kind, settings, problem, dt)


def _refuse_settings(kind: str, settings: Excited) -> None:
    """Refuse settings that are none of the kind's, or without effect."""
    for name, kinds in _KINDS.items():
        value, option = getattr(settings, name), flag_of(Excited, name)
        if value is None:
            continue
        if kind not in kinds:
            raise InputError(f"{option} belongs to --excite {' or '.join(kinds)}, not to {kind}")
        if not np.isfinite(value):
            raise InputError(f"{option} is {value:g}, but must be finite")
        if value == 0.0 and name in ("force", "impulse"):
            raise InputError(f"{option} is 0, which excites nothing; it may be above or below")


def _force_of(settings: Excited, problem: Problem) -> float:
    """The force of an excitation, that of the first pantograph if none is set [N]."""
    static = problem.train.placements[0].static_force
    return static if settings.force is None else settings.force


def _moving_force(settings: Excited, problem: Problem, dt: float) -> MovingForce:
    """A force that moves with the train."""
    train = problem.train
    frequency, highest = settings.frequency or 0.0, 0.1 / dt
    allowed = f"be from 0 to {highest:g}, ten time steps a period"
    _refuse_unless(0.0 <= frequency <= highest, "--frequency-Hz", frequency, allowed)
    force = _force_of(settings, problem)
    _refuse_too_strong("--force-N", force, force)
    return MovingForce(force, frequency, train.start, train.speed, train.raise_time)


def _blow(kind: str, settings: Excited, problem: Problem, dt: float) -> Blow:
    """A pulse, or the blow of a hammer."""
    if problem.window.mode == BOUNDED:
        raise InputError(
            f"window.mode is bounded, which lets move what is near a train, but a {kind} has none: "
            "take exact, or off"
        )
    duration = DURATIONS[kind] if settings.duration is None else settings.duration
    allowed = f"be from {10 * dt:g}, ten time steps, to 10"
    _refuse_unless(10 * dt <= duration <= 10.0, "--duration-s", duration, allowed)
    ends = problem.line.support_positions[[0, -1]]
    at = float(ends.mean()) if settings.at is None else settings.at
    allowed = f"lie on the line, from {ends[0]:g} to {ends[1]:g} m"
    _refuse_unless(bool(ends[0] < at < ends[1]), "--at-m", at, allowed)
    if kind == HAMMER:
        impulse = IMPULSE if settings.impulse is None else settings.impulse
        blow = hammer(at, impulse, duration)
        _refuse_too_strong("--impulse-Ns", impulse, blow.peak)
        return blow
    force = _force_of(settings, problem)
    _refuse_too_strong("--force-N", force, force)
    return Blow(at, duration, force, False)


def _refuse_unless(is_allowed: bool, option: str, value: float, allowed: str) -> None:
    if not is_allowed:
        raise InputError(f"{option} is {value:g}, but must {allowed}")


def _refuse_too_strong(option: str, value: float, peak: float) -> None:
    """Raise InputError for a force up to ``peak`` [N] beyond those at which a march ends."""
    if not abs(peak) <= DIVERGED:
        raise InputError(
            f"{option} is {value:g}, a force of up to {abs(peak):g} N, but forces up to "
            f"{DIVERGED:g} N are simulated"
        )


def without_train(problem: Problem, excitation: Excitation) -> Problem:
    """The problem without its train, for as long as waves of the excitation take to the far end.

    A force that moves has the train's course.
    """
    train, ends = problem.train, problem.line.support_positions[[0, -1]]
    place = Placement(_ASIDE, 0.0, 0.0)
    if isinstance(excitation, MovingForce):
        course = Train(train.speed, train.start, train.end, 0.0, (place,))
    else:
        speeds = [slowest_wave_of(problem.line, wire) for wire in problem.line.wires]
        speed, slowest = max(speeds), min(speeds)
        duration = excitation.duration + np.abs(ends - excitation.at).max() / slowest
        # One that creeps: its place is nobody's business, its course is the run's duration.
        creep = 1e-3 * speed
        start = float(ends[0]) + 1e-3 * float(np.ptp(ends))
        course = Train(creep, start, start + creep * float(duration), 0.0, (place,))
    left_out = {"lowering", "vehicle_motion", "several_pantographs", "head_roll"}
    return replace(
        problem,
        train=course,
        contact=LinearLaw(0.0, 0.0),
        effects=problem.effects - left_out,
        numerics=replace(problem.numerics, scheme="one_solve", coupling="implicit"),
    )


class Watch(Observer):
    """Observer that shows the motion of all nodes at every so many steps.

    Parameters
    ----------
    every : steps from one time to the next
    seen : receivers of the motion
    """

    def __init__(self, every: int, seen: Sequence[TakesMotion]) -> None:
        self._every, self._seen = every, seen

    def start(self, stage: Stage) -> None:
        """Match the rows with nodes."""
        self._nodes = stage.owned_nodes
        self._axes = [(k, name) for k, name in enumerate("uvw") if name in stage.unknowns]

    def next_state(self, step: int) -> int:
        """No state is needed."""
        return NEVER

    def next_motion(self, step: int) -> int:
        """The next multiple."""
        return (step // self._every + 1) * self._every

    def observe(self, view: StepView) -> None:
        """Hand over, if it is time."""
        if view.step % self._every == 0:
            moved = np.zeros((self._nodes.size, 3))
            for axis, name in self._axes:
                moved[self._nodes, axis] = view.node_motion(name, False)
            for take in self._seen:
                take(view.time, moved)
