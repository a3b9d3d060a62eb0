"""Plan of a run: effects simulated and left out, size, and needs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.cases.result_folder.output_folder import volume
from catenary.cases.run.arrivals import arrival_facts
from catenary.cases.run.description import defect_facts, incident_facts, kind_lines
from catenary.cases.run.needs import Needs, needs_with_mesh, simulated_time
from catenary.cases.scene.checks.mesh_size import estimate_march
from catenary.cases.scene.scene import Scene, problem_of
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.slowest_wave import slowest_wave
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate.wording import counted, duration
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import numbering_of
from catenary.solver.model.unknowns import Unknowns
from catenary.solver.problem.problem import Problem, n_halvings
from catenary.solver.window.choice import moving_share, window_sentence

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
    figures : counts, speeds and times by name, in SI units
    needs : steps, estimates of memory and time, sizes of files
    warnings : sentences on waves from the ends of the line, empty if it is long enough
    rows : what a terminal shows of all this and of the scene, as label and text
    """

    case: str
    title: str
    on: list[EffectRow]
    off: list[EffectRow]
    figures: dict[str, float]
    needs: Needs
    warnings: list[str]
    rows: list[tuple[str, str]]


def effect_rows(scene: Scene, problem: Problem) -> tuple[list[EffectRow], list[EffectRow]]:
    """Effects that a run simulates and those that it does not, with the reason. Not collective."""
    active = {effect.name for effect in effects.active(problem)}
    on, off = [], []
    for name, effect in effects.registry().items():
        if name in active:
            if effect.always:
                reason = "part of every scene"
            else:
                reason = "switched on by the scene" if name in scene.effects else "default"
            on.append(EffectRow(name, effect.title, reason))
        else:
            reason = effect.instead(problem) or _NO_DATA + effect.data
            if scene.effects.get(name) is False:
                reason = "switched off by the scene"
            elif effect.applies(problem):
                reason = "off by default"
            off.append(EffectRow(name, effect.title, reason))
    return on, off


def make_plan(scene: Scene) -> Plan:
    """The plan of a scene, whose mesh it makes. Not collective."""
    from catenary.cases.run.scene_mesh import mesh_of

    problem, mesh = problem_of(scene), mesh_of(scene)
    on, off = effect_rows(scene, problem)
    waves = arrival_facts(scene, problem)
    numbering, needs = numbering_of(problem, mesh), needs_with_mesh(scene, mesh)
    return Plan(
        case=scene.case.name,
        title=scene.case.title,
        on=on,
        off=off,
        figures={
            "n_nodes": mesh.n_nodes,
            "n_unknowns": numbering.n_unknowns,
            "n_steps": needs.n_steps,
            "n_droppers": len(mesh.droppers),
            "n_steady_arms": len(mesh.steady_arms),
            "n_pantographs": len(problem.train.placements),
            "dt_s": problem.numerics.dt,
            "simulated_s": simulated_time(problem),
            "speed_m_per_s": problem.train.speed,
            "wave_speed_m_per_s": slowest_wave(problem.line),
            "memory_B": needs.memory,
            "wall_s": needs.march,
            "result_B": needs.files.result,
            "film_B": needs.files.film,
        },
        needs=needs,
        warnings=waves["warnings"],
        rows=[
            *_train_rows(scene, problem),
            ("ends", "; ".join(waves["ends"])),
            *(("waves", fact["says"]) for fact in waves["pantographs"]),
            *_step_rows(problem, mesh, numbering, needs),
            *_needs_rows(problem, needs),
        ],
    )


def _train_rows(scene: Scene, problem: Problem) -> Iterator[tuple[str, str]]:
    """Train, course and state of the line."""
    train, wave_speed = problem.train, slowest_wave(problem.line)
    forces = ", ".join(f"{place.static_force:.1f}" for place in train.placements)
    pantographs = counted(len(train.placements), "pantograph")
    yield "train", f"{3.6 * train.speed:g} km/h, {pantographs}, static force {forces} N"
    for name, lines in kind_lines(scene, problem).items():
        yield "pantograph", f"{name}, {lines[0]}"
    ratio = f"{train.speed / wave_speed:.2f} of the contact wire's wave speed"
    yield "speed", f"{ratio} ({3.6 * wave_speed:.1f} km/h)"
    yield "runs", f"from {train.start:g} to {train.end:g} m (leading pantograph)"
    yield "evaluated", f"from {problem.evaluation[0]:g} to {problem.evaluation[1]:g} m"
    for fact in defect_facts(scene, problem):
        yield "defect", fact["says"]
    for fact in incident_facts(scene, problem):
        yield "incident", f"at {fact['time_s']:.4g} s: {fact['says']}"


def _step_rows(
    problem: Problem, mesh: LineMesh, numbering: Unknowns, needs: Needs
) -> Iterator[tuple[str, str]]:
    """Mesh, unknowns and steps."""
    contact = problem.line.wires_of(Role.CONTACT)
    lengths = np.concatenate([np.diff(mesh.x(mesh.elements(wire.name))) for wire in contact])
    droppers, arms = len(mesh.droppers), len(mesh.steady_arms)
    yield (
        "mesh",
        f"{mesh.n_nodes} nodes, {counted(droppers, 'dropper')}, {counted(arms, 'steady arm')}, "
        f"elements of {lengths.min():.2f} to {lengths.max():.2f} m",
    )
    each, shared = len(numbering.names), effects.move_together(problem)
    of_nodes = f"of {mesh.n_nodes} nodes, up to {each} of each"
    if numbering.n_unknowns == mesh.n_nodes * each:
        of_nodes = f"= {mesh.n_nodes} nodes x {each}"
    elif shared:
        pairs = ", ".join(f"{one} with those of {other}" for one, other in shared.items())
        of_nodes = f"of {mesh.n_nodes} nodes, {pairs}"
    yield "unknowns", f"{numbering.n_unknowns} {of_nodes} ({', '.join(numbering.names)})"
    numerics = problem.numerics
    yield (
        "time",
        f"{simulated_time(problem):.2f} s in {counted(needs.n_steps, 'step')} of "
        f"{1e3 * numerics.dt:g} ms, scheme {numerics.scheme}",
    )
    if needs.slow_path is not None:
        yield "slower", str(needs.slow_path)
    if effects.simulated(problem).slackening:
        yield "slack", f"of a slack dropper, {_slack(problem)}"
    if numerics.adaptive_tolerance is not None:
        shortest = numerics.dt / 2 ** n_halvings(numerics.dt, numerics.smallest_dt)
        yield (
            "adapted",
            f"steps with a contact force wrong by more than {numerics.adaptive_tolerance:g} N, or "
            f"without a solution, are halved, down to {1e3 * shortest:g} ms (not in the estimates)",
        )
    if problem.window.moves:
        yield "window", window_sentence(problem)
        yield "moving", _moving(problem, needs, numbering.n_unknowns)


def _needs_rows(problem: Problem, needs: Needs) -> Iterator[tuple[str, str]]:
    """Estimates of memory and time, files and records."""
    yield "memory", f"about {needs.memory / 1e6:.0f} MB on one rank (estimate)"
    factor = simulated_time(problem) / needs.march
    yield (
        "march",
        f"about {duration(needs.march)} on one rank, real-time factor {factor:.1f} (estimate)",
    )
    result, film, report = map(volume, (needs.files.result, needs.files.film, needs.files.report))
    yield (
        "results",
        f"about {result} in run.h5, {film} in fields.h5, {report} of report (estimate)",
    )
    yield "recorded", "; ".join(needs.recording.sentences(problem.numerics.dt).values())


def _moving(problem: Problem, needs: Needs, n_dofs: int) -> str:
    """Sentence on the part of the line that moves with a window, and its benefit."""
    window = problem.window
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


def _slack(problem: Problem) -> str:
    """The law of a slack dropper, with the key that chooses it."""
    laws = effects.simulated(problem)
    keeps = laws.kept_ratio > 0
    share = f"{100.0 * laws.kept_ratio:g} %"
    if problem.slack_dampers_act:
        spring = f"keeps {share} of its force" if keeps else "is released"
        return f"spring {spring}, damper goes on acting (line.dropper.slack_damping = kept)"
    both = f"keep {share} of their force" if keeps else "are released"
    return f"spring and damper {both} (line.dropper.slack_damping = released)"


def plan_text(plan: Plan) -> str:
    """The plan as text for a terminal."""
    lines = [f"{plan.case}: {plan.title}", ""]
    lines += [f"  {label:10} {text}" for label, text in plan.rows]
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
