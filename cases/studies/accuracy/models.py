"""Axes of models: what equations say otherwise or leave out, each with its levels for a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catenary.cases.studies.accuracy.axis import Level

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

_SMALLEST_FIT = 0.5  # [Hz], as the verb ``pantograph`` does
# Effects that let wires move sideways and along the track.
_ACROSS, _ALONG = "lateral_motion", "axial_motion"
# Wires and fittings that a line may do without, by key of ``line``, and the topology that is left.
_PARTS = {
    "stitch_wire": "simple",
    "auxiliary_wire": "simple",
    "twin": "simple",
    "bridle": "single",
    "overlap": None,
}
_NEWMARK = ("numerics.integrator=newmark", "numerics.spectral_radius=")
_NO_LAW = ("contact.restitution=", "contact.hertz_stiffness_N_per_m1_5=",
           "contact.damping_N_s_per_m=", "contact.least_impact_speed_m_per_s=")  # fmt: skip
_ELASTIC = (*_NO_LAW, "effects.contact_damping=false")


def contacts(scene: Scene) -> list[Level]:
    """Laws of the contact, and stiffnesses of the linear one."""
    levels = [
        Level(
            f"linear_{k:g}",
            (*_ELASTIC, "contact.law=linear", f"contact.stiffness_N_per_m={k:g}"),
            quick=k in (5e4, 2e5),
        )
        for k in (2e4, 5e4, 1e5, 2e5, 1e6)
    ]
    levels.append(Level("hertz", (*_ELASTIC, "contact.law=hertz")))
    levels += [
        Level(
            f"{law}_0.6",
            (
                *_NO_LAW,
                f"contact.law={law}",
                "contact.restitution=0.6",
                "effects.contact_damping=true",
            ),  # fmt: skip
        )
        for law in ("lankarani_nikravesh", "hunt_crossley", "flores", "gonthier")
    ]
    # Without numerical damping the force of a contact that does not give way alternates.
    damped = (*_NEWMARK, "numerics.newmark_gamma=0.55", "numerics.newmark_beta=0.28")
    rigid = (*_ELASTIC, "contact.stiffness_N_per_m=", "contact.law=kinematic", *damped)
    return [*levels, Level("kinematic_newmark_0.55", rigid)]


def droppers(scene: Scene) -> list[Level]:
    """Laws of slack droppers."""
    slack, kept = "effects.dropper_slackening", "effects.residual_dropper_stiffness"
    slackens, damper = (f"{kept}=false", f"{slack}=true"), "line.dropper.slack_damping"
    return [
        Level("linear", (f"{kept}=false", f"{slack}=false"), quick=True),
        Level("slackening", (*slackens, f"{damper}=released"), quick=True),
        Level("slackening_damped", (*slackens, f"{damper}=kept")),
        Level(
            "residual_0.01",
            (
                f"{slack}=true",
                f"{kept}=true",
                "line.dropper.residual_stiffness_ratio=0.01",
                f"{damper}=released",
            ),
        ),
    ]


def pantographs(scene: Scene) -> list[Level]:
    """Lumped chains fitted to the scene's leading kind; a mechanism also with all its bodies.

    A chain is not fitted with more masses than it has: the data say nothing of the others.
    """
    kind = scene.train.pantographs[0].name
    table = scene.pantographs[kind]
    most = len(table.masses_kg) if table.type == "lumped" else 3
    levels = [_fitted(scene, kind, n) for n in range(1, min(most, 3) + 1)]
    if table.type == "multibody":
        motion = f"pantographs.{kind}.motion"
        levels.append(Level("reduced", (f"{motion}=reduced",), quick=True))
        levels.append(Level("all_bodies", (f"{motion}=all_bodies",)))
    return levels


def _fitted(scene: Scene, kind: str, n_masses: int) -> Level:
    """All pantographs of the train as chains fitted to a kind, as the verb ``pantograph`` does."""
    from catenary.cases.studies.pantograph_response import Range, inline_table, study

    found = study(scene, kind, n_masses, Range(0.1, 25.0, 2, _SMALLEST_FIT))
    name = f"fitted_{n_masses}"
    assignments = [f"pantographs.{name}={inline_table(found)}"]
    for place in range(len(scene.train.pantographs)):
        assignments += [
            f"train.pantographs.{place}.name={name}",
            f"train.pantographs.{place}.reversed=",
        ]
    return Level(f"fitted_{n_masses}_mass", tuple(assignments), quick=n_masses == 2)


def planes(scene: Scene) -> list[Level]:
    """Planes in which wires move: sideways, and along the track if they have what that needs."""
    from catenary.cases.scene.checks.effects import RELATIVE_MOTION, needs_relative_motion
    from catenary.cases.scene.problem import problem_of
    from catenary.solver.effects import all_effects

    problem = problem_of(scene)
    with_data = all_effects.registry()[_ALONG].applies(problem)
    # Twin wires that move as one do so in the vertical plane only.
    apart = (f"effects.{RELATIVE_MOTION}=true",) if needs_relative_motion(problem, _ACROSS) else ()
    levels = {"vertical": (False, False), "lateral": (True, False)}
    if with_data:
        levels |= {"axial": (False, True), "three_planes": (True, True)}
    return [
        Level(
            name,
            (
                f"effects.{_ACROSS}={str(across).lower()}",
                f"effects.{_ALONG}={str(along).lower()}",
                *(apart if across or along else ()),
            ),
            quick=name in ("vertical", "lateral"),
        )
        for name, (across, along) in levels.items()
    ]


# Damping of a wire itself, of whole lines as it was measured on their vertical motion (ratios of
# 0.01 and 0.05 at 1.4 Hz), and so much that no wave comes back from a mast [1/s]; see the README of
# ac_simple_3d. None was measured on lateral motion.
_ACROSS_DAMPINGS = (0.003, 0.2, 0.9, 3.0, 10.0)


def lateral_dampings(scene: Scene) -> list[Level]:
    """Dampings of the wires' lateral motion, on their mass alone; none without that motion."""
    if not scene.switches()[_ACROSS]:
        return []
    return [
        Level(
            f"{beta:g}_per_s",
            (f"line.damping.lateral={{alpha_s=0.0, beta_per_s={beta:g}}}",),
            quick=beta in (0.003, 0.9),
        )
        for beta in _ACROSS_DAMPINGS
    ]


def parts_of_the_line(scene: Scene) -> list[Level]:
    """The line without each wire or fitting that it can do without; none of a simple line."""
    levels = []
    for part, left in _PARTS.items():
        if getattr(scene.line, part) is not None:
            topology = [] if left is None else [f"line.topology={left}"]
            levels.append(Level(f"without_{part}", (f"line.{part}=", *topology), quick=True))
    return levels
