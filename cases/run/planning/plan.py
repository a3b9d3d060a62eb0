"""Plan of a run: effects simulated and left out, size, and needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from catenary.cases.result_folder.output_folder import volume
from catenary.cases.run.describe.arrivals import arrival_facts, end_sentences
from catenary.cases.run.describe.defects import defect_facts, incident_facts
from catenary.cases.run.describe.pantographs import kind_lines
from catenary.cases.run.planning.file_sizes import FileSizes
from catenary.cases.run.planning.needs import Needs, needs_with_mesh, simulated_time
from catenary.cases.run.recording import extent_of
from catenary.cases.scene.cost_model import estimate_march
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.meshgen.slowest_wave import slowest_wave
from catenary.postproc.evaluate.wording import counted, duration
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import numbering_of
from catenary.solver.effects.effect import Effect
from catenary.solver.problem.problem import Numerics, Problem, n_halvings
from catenary.solver.window.choice import moving_share, window_sentence

if TYPE_CHECKING:
    from catenary.meshgen.mesh import LineMesh


# Reason for leaving out an effect without data; the keys that would give it some follow.
_NO_DATA = "the scene has no data for it: "


class EffectRow(NamedTuple):
    """An effect and why it is, or is not, part of a run."""

    name: str
    title: str
    reason: str

    @property
    def needs(self) -> str:
        """Keys that would give it data; empty if it has some."""
        return self.reason.removeprefix(_NO_DATA) if self.reason.startswith(_NO_DATA) else ""


@dataclass(frozen=True)
class Plan:
    """A run before it is made.

    Attributes
    ----------
    case, title : of the scene
    on, off : effects that are simulated, and those that are not
    unknowns : names of the unknowns at each node
    shared : wires that have the unknowns of others, each with the name of the other one
    n_nodes, n_dofs, n_steps : sizes
    n_droppers, n_arms, n_pantographs : counts
    element_lengths : shortest and longest element of the contact wire [m]
    speed, wave_speed : of the train and of the contact wire [m/s]
    static_forces : of the pantographs [N]
    kinds : name and description of each kind of pantograph on the train
    start, end, evaluation : stretch that the leading pantograph runs, and that is judged [m]
    defects : sentence of each irregularity, fitting and defect
    incidents : time [s] and sentence of each, in order of time
    ends : how the line begins and ends, in words
    arrivals : sentences about run-in and waves from the ends of the line
    warnings : sentences about them, empty if the line is long enough
    dt, simulated : time step and simulated time [s]
    scheme : way through a step
    slow_path : why steps take longer than they could, empty if they do not
    halved : sentence on steps that adapt, empty if none do
    slack : law of a slack dropper, in words; empty if no dropper slackens
    window : which part of the line moves, in words; empty if all of it
    moving : how much that is, and what a step of it costs, in words
    memory : estimate of the resident memory on one rank [B]
    march : estimate of the wall time of the time loop on one rank [s]
    files : sizes of the files
    recorded : sentences on the records of line and snapshots, by the kind of record
    """

    case: str
    title: str
    on: list[EffectRow]
    off: list[EffectRow]
    unknowns: tuple[str, ...]
    shared: tuple[tuple[str, str], ...]
    n_nodes: int
    n_dofs: int
    n_steps: int
    n_droppers: int
    n_arms: int
    n_pantographs: int
    element_lengths: tuple[float, float]
    speed: float
    wave_speed: float
    static_forces: tuple[float, ...]
    kinds: tuple[tuple[str, str], ...]
    start: float
    end: float
    evaluation: tuple[float, float]
    defects: tuple[str, ...]
    incidents: tuple[tuple[float, str], ...]
    ends: tuple[str, str]
    arrivals: tuple[str, ...]
    warnings: tuple[str, ...]
    dt: float
    scheme: str
    slow_path: str
    halved: str
    slack: str
    window: str
    moving: str
    simulated: float
    memory: float
    march: float
    files: FileSizes
    recorded: dict[str, str]


def effect_rows(scene: Scene, problem: Problem) -> tuple[list[EffectRow], list[EffectRow]]:
    """Effects that a run simulates and those that it does not, with the reason. Not collective."""
    active = {effect.name for effect in effects.active(problem)}
    on, off = [], []
    for name, effect in effects.registry().items():
        if name in active:
            if effect.always:
                reason = "part of every scene"
            else:
                reason = "asked for by the scene" if name in scene.effects else "default"
            on.append(EffectRow(name, effect.title, reason))
        else:
            off.append(_left_out(scene, problem, effect))
    return on, off


def _left_out(scene: Scene, problem: Problem, effect: Effect) -> EffectRow:
    if scene.effects.get(effect.name) is False:
        return EffectRow(effect.name, effect.title, "left out by the scene")
    if effect.applies(problem):
        return EffectRow(effect.name, effect.title, "off unless the scene asks for it")
    return EffectRow(effect.name, effect.title, effect.instead(problem) or _NO_DATA + effect.data)


def make_plan(scene: Scene, mesh: LineMesh | None = None) -> Plan:
    """The plan of a scene; makes the mesh if it is not given. Not collective."""
    import numpy as np

    from catenary.cases.run.scene_mesh import mesh_of
    from catenary.meshgen.wires import Role

    problem = problem_of(scene)
    mesh = mesh_of(scene) if mesh is None else mesh
    extent = extent_of(mesh)
    on, off = effect_rows(scene, problem)
    numbering = numbering_of(problem, mesh)
    train, dt = problem.train, problem.numerics.dt
    needs = needs_with_mesh(scene, mesh)
    contact = problem.line.wires_of(Role.CONTACT)
    length = np.concatenate([np.diff(mesh.x(mesh.elements(wire.name))) for wire in contact])
    waves = arrival_facts(scene, problem)
    return Plan(
        case=scene.case.name,
        title=scene.case.title,
        on=on,
        off=off,
        unknowns=numbering.names,
        shared=tuple(effects.move_together(problem).items()),
        n_nodes=mesh.n_nodes,
        n_dofs=numbering.n_unknowns,
        n_steps=needs.n_steps,
        n_droppers=extent.dropper_x.size,
        n_arms=extent.arm_x.size,
        n_pantographs=len(train.placements),
        element_lengths=(float(length.min()), float(length.max())),
        speed=train.speed,
        wave_speed=slowest_wave(problem.line),
        static_forces=tuple(place.static_force for place in train.placements),
        kinds=tuple((name, text[0]) for name, text in kind_lines(scene, problem).items()),
        start=train.start,
        end=train.end,
        evaluation=problem.evaluation,
        defects=tuple(fact["says"] for fact in defect_facts(scene, problem)),
        incidents=tuple((fact["time_s"], fact["says"]) for fact in incident_facts(scene, problem)),
        ends=end_sentences(problem),
        arrivals=tuple(fact["says"] for fact in waves["pantographs"]),
        warnings=tuple(waves["warnings"]),
        dt=dt,
        scheme=problem.numerics.scheme,
        slow_path="" if needs.slow_path is None else str(needs.slow_path),
        halved=_halved(problem.numerics),
        slack=_slack(problem),
        window=window_sentence(problem),
        moving=_moving(problem, needs, numbering.n_unknowns),
        simulated=simulated_time(problem),
        memory=needs.memory,
        march=needs.march,
        files=needs.files,
        recorded=needs.recording.sentences(dt),
    )


def _moving(problem: Problem, needs: Needs, n_dofs: int) -> str:
    """Sentence on the part of the line that moves with a window, and its benefit."""
    window = problem.window
    if not window.moves:
        return ""
    share, n_spans = moving_share(problem), problem.line.support_positions.size - 1
    step = needs.march / needs.n_steps
    whole = step * estimate_march(n_dofs, 1, problem.numerics.scheme)
    whole /= estimate_march(round(share * n_dofs), 1, problem.numerics.scheme)
    spans = max(1, round(share * n_spans))
    grows = ""
    if window.by_motion > 0.0:
        grows = "; it grows with the waves, up to the whole line where these do not fade"
    elif share * n_spans > window.spans_ahead + window.spans_behind + 1.0:
        grows = "; it holds the way from the first pantograph to the last one as well"
    return (
        f"{spans} of {counted(n_spans, 'span')} on the mean of the run: {1e6 * step:.0f} us a step "
        f"in place of {1e6 * whole:.0f} (estimate){grows}"
    )


def _halved(numerics: Numerics) -> str:
    tolerance = numerics.adaptive_tolerance
    if tolerance is None:
        return ""
    shortest = numerics.dt / 2 ** n_halvings(numerics.dt, numerics.smallest_dt)
    return (
        f"steps with a contact force wrong by more than {tolerance:g} N, or without a solution, "
        f"are halved, down to {1e3 * shortest:g} ms (not in the estimates)"
    )


def _slack(problem: Problem) -> str:
    """The law of a slack dropper, with the key that chooses it; empty if none slackens."""
    laws = effects.simulated(problem)
    if not laws.slackening:
        return ""
    keeps = laws.kept_ratio > 0
    share = f"{100.0 * laws.kept_ratio:g} %"
    if problem.slack_dampers_act:
        spring = f"keeps {share} of its force" if keeps else "is released"
        return f"spring {spring}, damper goes on acting (line.dropper.slack_damping = kept)"
    both = f"keep {share} of their force" if keeps else "are released"
    return f"spring and damper {both} (line.dropper.slack_damping = released)"


def plan_text(plan: Plan) -> str:
    """The plan as text for a terminal."""
    ratio = plan.speed / plan.wave_speed
    forces = ", ".join(f"{force:.1f}" for force in plan.static_forces)
    pantographs = counted(plan.n_pantographs, "pantograph")
    rows = [
        ("train", f"{3.6 * plan.speed:g} km/h, {pantographs}, static force {forces} N"),
        *(("pantograph", f"{name}, {text}") for name, text in plan.kinds),
        (
            "speed",
            f"{ratio:.2f} of the contact wire's wave speed ({3.6 * plan.wave_speed:.1f} km/h)",
        ),
        ("runs", f"from {plan.start:g} to {plan.end:g} m (leading pantograph)"),
        ("evaluated", f"from {plan.evaluation[0]:g} to {plan.evaluation[1]:g} m"),
        *(("defect", sentence) for sentence in plan.defects),
        *(("incident", f"at {time:.4g} s: {sentence}") for time, sentence in plan.incidents),
        ("ends", "; ".join(plan.ends)),
        *(("waves", sentence) for sentence in plan.arrivals),
        (
            "mesh",
            f"{plan.n_nodes} nodes, {counted(plan.n_droppers, 'dropper')}, "
            f"{counted(plan.n_arms, 'steady arm')}, "
            f"elements of {plan.element_lengths[0]:.2f} to {plan.element_lengths[1]:.2f} m",
        ),
        (
            "unknowns",
            f"{plan.n_dofs} {_nodes_of_unknowns(plan)} ({', '.join(plan.unknowns)})",
        ),
        (
            "time",
            f"{plan.simulated:.2f} s in {counted(plan.n_steps, 'step')} of {1e3 * plan.dt:g} ms, "
            f"scheme {plan.scheme}",
        ),
        *([("slower", plan.slow_path)] if plan.slow_path else []),
        *([("slack", f"of a slack dropper, {plan.slack}")] if plan.slack else []),
        *([("adapted", plan.halved)] if plan.halved else []),
        *([("window", plan.window), ("moving", plan.moving)] if plan.window else []),
        ("memory", f"about {plan.memory / 1e6:.0f} MB on one rank (estimate)"),
        (
            "march",
            f"about {duration(plan.march)} on one rank, real-time factor "
            f"{plan.simulated / plan.march:.1f} (estimate)",
        ),
        (
            "results",
            f"about {volume(plan.files.result)} in run.h5, "
            f"{volume(plan.files.film)} in fields.h5, {volume(plan.files.report)} of report "
            "(estimate)",
        ),
        ("recorded", "; ".join(plan.recorded.values())),
    ]
    lines = [f"{plan.case}: {plan.title}", ""]
    lines += [f"  {label:10} {text}" for label, text in rows]
    lines += [""] * bool(plan.warnings) + [f"  WARNING    {text}" for text in plan.warnings]
    lines += ["", "Simulated:", *_effect_lines(plan.on)]
    able = [row for row in plan.off if not row.needs]
    unable = [row for row in plan.off if row.needs]
    lines += ["", "Not simulated:", *_effect_lines(able)]
    if unable:
        width = max(len(row.name) for row in unable)
        lines += ["", "Not simulated, since the scene has no data for it; what gives it data:"]
        lines += [f"  {row.name:{width}}  {row.title}: {row.needs}" for row in unable]
    return "\n".join(lines)


def _effect_lines(rows: list[EffectRow]) -> list[str]:
    if not rows:
        return ["  (nothing)"]
    width = max(len(row.name) for row in rows)
    return [f"  {row.name:{width}}  {row.title} ({row.reason})" for row in rows]


def _nodes_of_unknowns(plan: Plan) -> str:
    each = len(plan.unknowns)
    if plan.n_dofs == plan.n_nodes * each:
        return f"= {plan.n_nodes} nodes x {each}"
    if plan.shared:
        pairs = ", ".join(f"{one} with those of {other}" for one, other in plan.shared)
        return f"of {plan.n_nodes} nodes, {pairs}"
    return f"of {plan.n_nodes} nodes, up to {each} of each"
