"""The axes of ``catenary accuracy``: one table, to which an axis is added with one entry.

An axis of *discretisation* changes how exactly the scene's equations are solved: its levels are
compared with a reference that is finer in all that the axis refines, and whose own uncertainty
coarser ones tell. An axis of *models* changes the equations: its levels differ from the scene as it
is, and no difference is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import shown_word

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


DISCRETISATION, MODEL = "discretisation", "model"


@dataclass(frozen=True)
class Level:
    """One setting of an axis.

    Attributes
    ----------
    name : short, unique within its axis
    assignments : ``key=value`` each, on top of the scene
    sizes : refined sizes by name: ``dt`` [s], ``h`` as a share of a gap; empty if nothing is
    quick : whether the level also belongs to the short form of the axis
    """

    name: str
    assignments: tuple[str, ...]
    sizes: Mapping[str, float] = field(default_factory=dict)
    quick: bool = False


# For each size that an axis refines three levels, of which each has half the fineness of the one
# before it. The very first level is the reference, finer than every level of the axis; the first
# ones of the others have its fineness in their size.
Chains = tuple[tuple[Level, Level, Level], ...]


@dataclass(frozen=True)
class Axis:
    """A setting, or several together, that a study varies.

    Attributes
    ----------
    name, title : for the option ``--axes`` and for headings
    levels : returns the levels for a scene; empty if the scene has nothing to vary
    chains : returns those to the reference of a discretisation axis, in the long or the short form;
        None for models, which are compared with the unchanged scene
    refined : the size of the levels to which an observed order belongs, "" if none
    step_alone : returns the level with the same mesh and the reference's step. The difference of
        the two is the error of the step, the remainder that of the mesh; None if the axis does not
        refine both
    """

    name: str
    title: str
    levels: Callable[[Scene], Sequence[Level]]
    chains: Callable[[bool], Chains] | None = None
    refined: str = ""
    step_alone: Callable[[Level], Level] | None = None

    @property
    def kind(self) -> str:
        """Whether its levels solve the same equations, ``DISCRETISATION``, or others, ``MODEL``."""
        return MODEL if self.chains is None else DISCRETISATION

    def chosen(self, scene: Scene, quick: bool) -> list[Level]:
        """The levels of the axis for a scene, in the long or the short form."""
        return [level for level in self.levels(scene) if level.quick or not quick]


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


def _level(name: str, *assignments: str, quick: bool = False) -> Level:
    return Level(name, assignments, quick=quick)


def contacts(scene: Scene) -> list[Level]:
    """Laws of the contact, and stiffnesses of the linear one."""
    law, stiffness = "contact.law=", "contact.stiffness_N_per_m="
    lossy = ("contact.restitution=0.6", "effects.contact_damping=true")
    # Without numerical damping the force of a contact that does not give way alternates.
    damped = (*_NEWMARK, "numerics.newmark_gamma=0.55", "numerics.newmark_beta=0.28")
    return [
        *(
            _level(f"linear_{k:.0f}", *_ELASTIC, f"{law}linear", f"{stiffness}{k:g}", quick=quick)
            for k, quick in ((2e4, False), (5e4, True), (1e5, False), (2e5, True), (1e6, False))
        ),
        _level("hertz", *_ELASTIC, f"{law}hertz"),
        *(
            _level(f"{name}_0.6", *_NO_LAW, law + name, *lossy)
            for name in ("lankarani_nikravesh", "hunt_crossley", "flores", "gonthier")
        ),
        _level("kinematic_newmark_0.55", *_ELASTIC, stiffness, f"{law}kinematic", *damped),
    ]


def droppers(scene: Scene) -> list[Level]:
    """Laws of slack droppers."""
    slack, kept = "effects.dropper_slackening=", "effects.residual_dropper_stiffness="
    damper, ratio = "line.dropper.slack_damping=", "line.dropper.residual_stiffness_ratio="
    slackens = (f"{kept}false", f"{slack}true")
    residual = (f"{slack}true", f"{kept}true", f"{ratio}0.01", f"{damper}released")
    return [
        _level("linear", f"{kept}false", f"{slack}false", quick=True),
        _level("slackening", *slackens, f"{damper}released", quick=True),
        _level("slackening_damped", *slackens, f"{damper}kept"),
        _level("residual_0.01", *residual),
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
        levels.append(_level("reduced", f"{motion}=reduced", quick=True))
        levels.append(_level("all_bodies", f"{motion}=all_bodies"))
    return levels


def _fitted(scene: Scene, kind: str, n_masses: int) -> Level:
    """All pantographs of the train as chains fitted to a kind, as the verb ``pantograph`` does."""
    from catenary.cases.studies.asked import Frequencies
    from catenary.cases.studies.pantograph_response import inline_table, study

    found = study(scene, kind, n_masses, Frequencies(n_points=2, fit_low=_SMALLEST_FIT))
    name = f"fitted_{n_masses}"
    assignments = [f"pantographs.{name}={inline_table(found)}"]
    for place in range(len(scene.train.pantographs)):
        own = f"train.pantographs.{place}"
        assignments += [f"{own}.name={name}", f"{own}.reversed="]
    return _level(f"fitted_{n_masses}_mass", *assignments, quick=n_masses == 2)


def planes(scene: Scene) -> list[Level]:
    """Planes in which wires move: sideways, and along the track if they have what that needs."""
    from catenary.cases.scene.checks.effects import RELATIVE_MOTION, needs_relative_motion
    from catenary.cases.scene.scene import problem_of
    from catenary.solver.effects import all_effects

    problem = problem_of(scene)
    with_data = all_effects.registry()[_ALONG].applies(problem)
    # Twin wires that move as one do so in the vertical plane only.
    apart = (f"effects.{RELATIVE_MOTION}=true",) if needs_relative_motion(problem, _ACROSS) else ()
    across, along = f"effects.{_ACROSS}=", f"effects.{_ALONG}="
    levels = [
        _level("vertical", f"{across}false", f"{along}false", quick=True),
        _level("lateral", f"{across}true", f"{along}false", *apart, quick=True),
    ]
    if with_data:
        levels.append(_level("axial", f"{across}false", f"{along}true", *apart))
        levels.append(_level("three_planes", f"{across}true", f"{along}true", *apart))
    return levels


# Damping of a wire itself, of whole lines as it was measured on their vertical motion (ratios of
# 0.01 and 0.05 at 1.4 Hz), and so much that no wave comes back from a mast [1/s]; see the README of
# ac_simple_3d. None was measured on lateral motion.
_ACROSS_DAMPINGS = (0.003, 0.2, 0.9, 3.0, 10.0)


def lateral_dampings(scene: Scene) -> list[Level]:
    """Dampings of the wires' lateral motion, on their mass alone; none without that motion."""
    if not scene.switches()[_ACROSS]:
        return []
    damping = "line.damping.lateral={{alpha_s=0.0, beta_per_s={:g}}}"
    return [
        _level(f"{beta:g}_per_s", damping.format(beta), quick=beta in (0.003, 0.9))
        for beta in _ACROSS_DAMPINGS
    ]


def parts_of_the_line(scene: Scene) -> list[Level]:
    """Lines without one optional wire or fitting each; none for a simple line."""
    levels = []
    for part, left in _PARTS.items():
        if getattr(scene.line, part) is not None:
            topology = [] if left is None else [f"line.topology={left}"]
            levels.append(_level(f"without_{part}", f"line.{part}=", *topology, quick=True))
    return levels


def parse_axes(text: str | None) -> list[Axis]:
    """The axes of a list with commas, all if it is left out.

    Raises
    ------
    InputError
        If a name is unknown or given twice.
    """
    if text is None:
        return list(AXES.values())
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in AXES:
            raise InputError(f"--axes {shown_word(name)} is unknown; there are {', '.join(AXES)}")
        if names.count(name) > 1:
            raise InputError(f"--axes names {name} twice")
    return [AXES[name] for name in names]


# ---- step and mesh ------------------------------------------------------------------------------


def step(dt: float, elements: int | None = None, quick: bool = False) -> Level:
    """Level with a time step ``dt`` [s], and with ``elements`` per gap of droppers if given;
    ``quick`` if the short form of the study has it."""
    name, word = f"{1e3 * dt:g}_ms", f"numerics.dt_s={dt:g}"
    if elements is None:
        return Level(name, (word,), {"dt": dt}, quick)
    words = word, f"mesh.elements_per_gap={elements}"
    return Level(f"{name}_{elements}_elements", words, {"dt": dt, "h": 1.0 / elements}, quick)


def mesh(elements: int, quick: bool = False, dt: float | None = None) -> Level:
    """Level with ``elements`` per gap of droppers, at a time step ``dt`` [s], or at the scene's
    own; ``quick`` if the short form of the study has it."""
    assignments = [f"mesh.elements_per_gap={elements}"]
    assignments += [] if dt is None else [f"numerics.dt_s={dt:g}"]
    return Level(f"{elements}_elements", tuple(assignments), {"h": 1.0 / elements}, quick)


_STEPS = ((2e-4, False), (5e-4, False), (1e-3, True), (2e-3, True), (4e-3, False), (8e-3, False))
_ELEMENTS = (1, 2, 3, 4, 5, 6, 8, 12, 16)
_FEW_ELEMENTS = (3, 5)
# Step [s] and elements per gap, in the long form and the short one, of the reference for step and
# mesh together. Meshes are compared at this step: a fine mesh and a long step do not go together,
# see ``solver/linear/unit_responses.py``.
_FINEST_STEP, _FINEST_MESH, _QUICK_MESH = 2e-4, 40, 24


def _steps(scene: Scene) -> list[Level]:
    return [step(dt, None, quick) for dt, quick in _STEPS]


def _fine_step(quick: bool) -> Chains:
    """On the scene's own mesh: of the error of the step alone."""
    dt = 1.25e-4 if quick else 5e-5
    return ((step(dt), step(2 * dt), step(4 * dt)),)


def _meshes(scene: Scene) -> list[Level]:
    if scene.mesh.file is not None:
        return []
    return [mesh(n, n in _FEW_ELEMENTS, _FINEST_STEP) for n in _ELEMENTS]


def _fine_both(quick: bool) -> Chains:
    dt, n = _FINEST_STEP, _QUICK_MESH if quick else _FINEST_MESH
    meshes = step(dt, n), step(dt, n // 2), step(dt, n // 4)
    # Steps on the coarsest of these meshes: fine meshes and long steps do not go together.
    steps = meshes[-1], step(2 * dt, n // 4), step(4 * dt, n // 4)
    return meshes, steps


def _at_the_finest_step(level: Level) -> Level:
    return step(_FINEST_STEP, round(1.0 / level.sizes["h"]))


# Fine meshes with long steps are left out of the grid, as above [s].
_LONGEST_STEP = {8: 1e-3, 12: 5e-4, 16: 5e-4}


def _grid(scene: Scene) -> list[Level]:
    if scene.mesh.file is not None:
        return []
    return [
        step(dt, n, dt in (1e-3, 2e-3) and n in _FEW_ELEMENTS)
        for dt in (5e-4, 1e-3, 2e-3, 4e-3)
        for n in _ELEMENTS
        if dt <= _LONGEST_STEP.get(n, 1.0)
    ]


# ---- scheme and coupling ------------------------------------------------------------------------

_ONE_SOLVE = ("numerics.iterations=", "numerics.scheme=one_solve")
# The paper's correction, so many times in every step, whatever they reach; or until changes are
# below tolerances, of which the loosest end every step after the first.
_PAPER = ("numerics.coupling=", "numerics.iterations=", "numerics.scheme=fixed_point")
_LOOSENESS = ((1e-2, 1.0), (1e-4, 1e-1), (1e-5, 1e-2), (1e-7, 1e-4))
_TOLERANCES: tuple[str, ...] = ("eps_d_m", "eps_v_m_per_s", "eps_force_N", "max_iterations")


def _without_tolerances(scene: Scene, of: tuple[str, ...]) -> tuple[str, ...]:
    """Removes the tolerances of iterations from a level that does not iterate."""
    return tuple(f"numerics.{name}=" for name in of if name in scene.numerics.model_fields_set)


def _one_solve(scene: Scene) -> tuple[str, ...]:
    """One solve a step with the scene's coupling; an iterated one has its tolerance."""
    exchanged = scene.numerics.coupling == "iterated"
    own = _TOLERANCES[:2] if exchanged else _TOLERANCES
    return (*_ONE_SOLVE, *_without_tolerances(scene, own))


def _newmark(scene: Scene, name: str, gamma: float, beta: float, quick: bool = False) -> Level:
    keys = (f"numerics.newmark_gamma={gamma}", f"numerics.newmark_beta={beta}")
    return _level(name, *_one_solve(scene), *_NEWMARK, *keys, quick=quick)


def _dissipating(integrator: str, radius: float) -> tuple[str, ...]:
    own = (f"numerics.integrator={integrator}", f"numerics.spectral_radius={radius}")
    return (*own, "numerics.newmark_gamma=", "numerics.newmark_beta=")


def _schemes(scene: Scene) -> list[Level]:
    alphas = [("generalized_alpha", radius) for radius in (0.9, 0.8, 0.5, 0.0)]
    one, paper = _one_solve(scene), (*_PAPER, *_without_tolerances(scene, ("eps_force_N",)))
    times = (*paper, "numerics.max_iterations=")
    return [
        _newmark(scene, "average_acceleration", 0.5, 0.25, True),
        _newmark(scene, "newmark_0.55", 0.55, 0.28, True),
        _newmark(scene, "newmark_0.6", 0.6, 0.3025),
        *(
            _level(f"{name}_{radius:g}", *one, *_dissipating(name, radius))
            for name, radius in (*alphas, ("hht", 0.9), ("hht", 0.8))
        ),
        *(
            _level(f"corrected_{n}_times", *times, f"numerics.iterations={n}")
            for n in (1, 2, 4, 6, 10, 20)
        ),
        *(
            _level(
                f"corrected_to_{d:g}_m",
                *paper,
                f"numerics.eps_d_m={d:g}",
                f"numerics.eps_v_m_per_s={v:g}",
            )  # fmt: skip
            for d, v in _LOOSENESS
        ),
    ]


def _couplings(scene: Scene) -> list[Level]:
    own = {"implicit": _TOLERANCES, "iterated": _TOLERANCES[:2], "explicit": _TOLERANCES}
    return [
        _level(
            name,
            *_ONE_SOLVE,
            *_without_tolerances(scene, taken),
            f"numerics.coupling={name}",
            quick=name != "iterated",
        )  # fmt: skip
        for name, taken in own.items()
    ]


# Steps that adapt: longest step [s], and how wrong a contact force may be in one step [N].
_ADAPTED = ((1e-3, 1.0), (1e-3, 0.1), (4e-3, 10.0), (4e-3, 1.0), (4e-3, 0.1))


def _adaptive(scene: Scene) -> list[Level]:
    one = _one_solve(scene)
    return [
        _level(
            f"{1e3 * dt:g}_ms_{tolerance:g}_N",
            *one,
            f"numerics.dt_s={dt:g}",
            f"numerics.adaptive_tolerance_N={tolerance:g}",
            quick=tolerance == 10.0,
        )  # fmt: skip
        for dt, tolerance in _ADAPTED
    ]


_ALL = (
    Axis("dt", "time step, on the case's mesh", _steps, _fine_step, "dt"),
    Axis("elements", "elements per gap, step 0.2 ms", _meshes, _fine_both, "h"),
    Axis("grid", "time step and elements per gap", _grid, _fine_both, "", _at_the_finest_step),
    Axis("scheme", "scheme, at the case's step", _schemes, _fine_step),
    Axis("coupling", "coupling, at the case's step", _couplings, _fine_step),
    Axis("adaptive", "steps halved where a force is wrong", _adaptive, _fine_step),
    Axis("contact", "contact law and stiffness", contacts),
    Axis("dropper", "dropper model", droppers),
    Axis("pantograph", "pantograph model", pantographs),
    Axis("planes", "planes in which wires move", planes),
    Axis("lateral_damping", "damping of lateral motion", lateral_dampings),
    Axis("parts", "the line without one of its parts", parts_of_the_line),
)
AXES = {axis.name: axis for axis in _ALL}
