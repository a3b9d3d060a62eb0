"""What a scene leaves out does not exist: counted in the model, one effect at a time."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Set
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_lines import BARE, EN_PANTOGRAPH, ac_simple_line, mesh_of, problem_of, train

from catenary.mbs.air.uplift import Polynomial, Uplift
from catenary.mbs.build import Operation, make_pantograph
from catenary.mbs.control.regulation import Regulation
from catenary.mbs.head.flexure import Flexure
from catenary.mbs.head.laws import Law
from catenary.mbs.head.strips import Strips, Suspension, Turning
from catenary.mbs.head.wire_crossing import LateralPath
from catenary.mbs.lowering import Lowering
from catenary.mbs.vehicle.motion_sources import Harmonic, VehicleMotion
from catenary.mbs.vehicle.suspension import Vehicle
from catenary.meshgen.hardware import Fittings
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build
from catenary.solver.effects.effect import Limit
from catenary.solver.model.model import Model
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.defects import (
    HardSpot,
    Kink,
    LooseClamp,
    MissingDropper,
    WornWire,
    WrongTension,
)
from catenary.solver.problem.incidents import DropperBreak, TensionLoss
from catenary.solver.problem.irregularities import Heights, Irregularities, LengthErrors
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.problem.wind import Gusts, Wind
from catenary.solver.statics.equilibrium import find_form

N_SPANS = 4
WIND = Wind(25.0, gusts=Gusts(2.0))
CAR = Vehicle(3e4, 2e6, 9e5, 4e4, 19.0, 2.5)
INSULATORS = Fittings("section_insulator", CONTACT_WIRE, (100.3, 101.7), (5.0, 5.0))
DEFECTS = (
    MissingDropper(88.25),
    LooseClamp(137.5),
    WornWire(CONTACT_WIRE, 60.0, 80.0, 0.2),
    WrongTension(CONTACT_WIRE, 1.05),
    HardSpot(CONTACT_WIRE, 120.2, 5.0, 300.0),
    Kink(CONTACT_WIRE, 130.0, 0.01),
)


def full_line() -> LineData:
    """A line on which every shipped effect finds something to act on."""
    line = ac_simple_line(N_SPANS)
    return replace(
        line,
        steady_arm=replace(line.steady_arm, stiffness=300.0),
        contact_wire=replace(line.contact_wire, diameter=0.0144),
        messenger_wire=replace(line.messenger_wire, diameter=0.014),
        n_transition=(1, 1),
        transition_rise=0.2,
    )


def full_problem(names: frozenset[str]) -> Problem:
    line = full_line()
    uplift = Uplift(Polynomial((0.0, 0.0, 0.01)))
    limiter = Law(1, 2, False, (-1.0, 0.1, 1.0), (0.0, 0.0, 9e3), from_rest=True)
    rolling = replace(EN_PANTOGRAPH, roll=Turning(2.0, 470.0, 1.0), uplift=uplift, laws=(limiter,))
    bending = Strips(
        length=1.6, suspension=Suspension(1.0, 8e3, 10.0), flexure=Flexure(600.0, 0.9, 2)
    )
    rolling = replace(rolling, strips=bending)
    speed = 1.1 * line.contact_wire.wave_speed
    ours = train(speed, 60.0, 160.0, data=rolling, behind=(0.0, 31.0))
    lowered = replace(
        ours.placements[0],
        lowering=Lowering(0.5, -50.0, 0.2, 0.4),
        regulator=Regulation(False, 120.0, ((0.0, 0.1, 1.0, 0.0),), -50.0, 50.0, 0.01),
    )
    heights = Heights((0.0, 220.0), None, ((90.0, 0.0), (100.0, 0.005), (110.0, 0.0)))
    return problem_of(
        replace(make_line(line), fittings=(INSULATORS,)),
        names,
        damping=Damping(1e-4, 0.0125),
        contact=LinearLaw(5e4, 50.0),
        train=replace(
            ours,
            vehicle=VehicleMotion((Harmonic(0.01, 1.0),), suspension=CAR),
            placements=(lowered, *ours.placements[1:]),
        ),
        residual_stiffness_ratio=0.01,
        incidents=(DropperBreak(0.5, 80.0), TensionLoss(0.6, MESSENGER_WIRE, 0.9)),
        irregularities=Irregularities(heights, heights, LengthErrors(0.001, 2.0, 1)),
        defects=DEFECTS,
        wind=WIND,
    )


def expected_terms(terms: object, n: dict[str, int]) -> int:
    """A number, a multiple of a count, or multiples of several counts."""
    if isinstance(terms, dict):
        return sum(factor * n.get(size, 1) for size, factor in terms.items())
    return terms if isinstance(terms, int) else terms[1] * n[terms[0]]


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(full_line(), 2)


def model_with(names: Set[str], mesh: LineMesh) -> Model:
    lengths = np.full(mesh.droppers.shape[0], 1.0)
    return build(full_problem(BARE | names), mesh, lengths)


def contents(model: Model) -> Counter[tuple[str, int, bool, bool]]:
    """Every block as component, number of elements, and which matrices it has."""
    return Counter(
        (block.component, block.dofs.shape[0], block.mass is not None, block.stiffness is not None)
        for block in model.blocks
    )


def counts(mesh: LineMesh) -> dict[str, int]:
    return {
        "elements": mesh.n_nodes - 2,
        "droppers": mesh.droppers.shape[0],
        "arms": mesh.steady_arms.size,
        "supports": mesh.supports.size,
        "fittings": 2,
        "one wire": (mesh.n_nodes - 2) // 2,
        "unknowns": 2 * mesh.n_nodes,
        "spots": 1,
    }


def test_a_bare_line_is_wires_droppers_and_supports(mesh: LineMesh) -> None:
    model = model_with(frozenset(), mesh)
    n = counts(mesh)
    assert model.terms_of == {"vertical": n["elements"] + n["droppers"] + n["supports"]}
    assert model.unknowns == ("w", "theta_y")
    assert model.n_dofs == 2 * mesh.n_nodes
    assert contents(model) == {
        ("messenger_wire", n["elements"] // 2, True, True): 1,
        ("contact_wire", n["elements"] // 2, True, True): 1,
        ("droppers", n["droppers"], False, True): 1,
        ("supports", n["supports"], False, True): 1,
    }
    assert model.constrained.size == 4
    assert not model.weight.any()
    assert model.loads == []
    assert not model.dropper_damping.any()


# Effect: the blocks that it adds, and the number of terms that it counts.
BLOCKS = {
    "gravity": ({}, 1),
    "pre_sag": ({}, 1),
    "transition_spans": ({}, 1),
    "dropper_mass": ({("droppers", "droppers", True, False): 2}, ("droppers", 2)),
    "clamp_mass": (
        {
            ("messenger_wire", "droppers", True, False): 1,
            ("contact_wire", "droppers", True, False): 1,
        },
        ("droppers", 2),
    ),
    "arm_inertia": ({("steady_arms", "arms", True, False): 1}, ("arms", 1)),
    "arm_stiffness": ({("steady_arms", "arms", False, True): 1}, ("arms", 1)),
    "structural_damping": ({}, 1),
    "dropper_slackening": ({}, 1),
    "residual_dropper_stiffness": ({}, 1),
    "contact_loss": ({}, 1),
    "contact_damping": ({}, 1),
    "several_pantographs": ({}, 1),
    "head_roll": ({}, 1),
    "vehicle_motion": ({}, 1),
    "pantograph_laws": ({}, 1),
    "flexible_strips": ({}, 1),
    "regulated_lift": ({}, 1),
    "vehicle_suspension": ({}, 1),
    "dropper_break": ({}, 1),
    "tension_loss": ({}, 1),
    "lowering": ({}, 1),
    "pantograph_aerodynamics": ({}, 1),
    "wind": (
        {
            ("messenger_wire", "one wire", False, False): 1,
            ("contact_wire", "one wire", False, False): 1,
        },
        {"elements": 1, "laws": 1},
    ),
    "gusts": ({}, {"unknowns": 1, "laws": 1}),
    "supercritical_speed": ({}, 1),
    "fittings": ({("contact_wire", "fittings", True, False): 1}, ("fittings", 1)),
    "contact_wire_height": ({}, 1),
    "dropper_lengths": ({}, 1),
    "running_surface": ({}, 1),
    "missing_dropper": ({}, 1),
    "loose_clamp": ({}, 1),
    "worn_wire": ({}, 1),
    "wrong_tension": ({}, 1),
    "hard_spot": (
        {
            ("contact_wire", "spots", True, False): 1,
            ("contact_wire", "spots", False, True): 1,
        },
        2,
    ),
    "kink": ({}, 1),
}
# The fields of `Simulated` that each effect sets.
LAWS = {
    "gravity": "gravity",
    "pre_sag": "target_heights",
    "transition_spans": "target_heights",
    "structural_damping": "damping",
    "dropper_slackening": "slackening kept_ratio",
    "contact_loss": "contact_loss",
    "contact_damping": "contact",
    "head_roll": "head_roll",
    "vehicle_motion": "vehicle",
    "pantograph_laws": "pantograph_laws",
    "flexible_strips": "flexible_strips",
    "regulated_lift": "regulated_lift",
    "vehicle_suspension": "suspension",
    "dropper_break": "incidents",
    "tension_loss": "incidents",
    "lowering": "lowering",
    "pantograph_aerodynamics": "meets_air",
    "wind": "wind",
    "gusts": "wind",
    "contact_wire_height": "irregular_heights",
    "dropper_lengths": "length_errors",
    "running_surface": "surface",
    "missing_dropper": "missing",
    "loose_clamp": "loose",
    "kink": "surface",
}
LIFTED = {
    "several_pantographs": (Limit.ONE_PANTOGRAPH,),
    "supercritical_speed": (Limit.WAVE_SPEED,),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_an_effect_sets_its_own_laws_and_no_others(name: str, mesh: LineMesh) -> None:
    bare, alone = (vars(model_with(names, mesh).simulated) for names in (frozenset(), {name}))
    assert {key for key in bare if alone[key] != bare[key]} == set(LAWS.get(name, "").split())
    assert effects.registry()[name].lifts == LIFTED.get(name, ())


def test_a_slack_dropper_keeps_a_share_only_if_droppers_slacken(mesh: LineMesh) -> None:
    residual = {"residual_dropper_stiffness"}
    assert model_with(residual, mesh).simulated.kept_ratio == 1.0
    both = model_with(residual | {"dropper_slackening"}, mesh).simulated
    assert (both.slackening, both.kept_ratio) == (True, 0.01)


def test_incidents_are_simulated_in_their_order(mesh: LineMesh) -> None:
    both = model_with({"tension_loss", "dropper_break"}, mesh)
    assert both.simulated.incidents == both.problem.incidents
    (loss,) = model_with({"tension_loss"}, mesh).simulated.incidents
    assert isinstance(loss, TensionLoss)


def test_no_effect_is_found_by_its_name() -> None:
    """What an effect contributes is read from `Simulated` and the model, in all of the solver."""
    names = set(effects.registry()) - {"vertical", "gravity", "pre_sag"}
    for path in (Path(__file__).parents[3] / "solver").rglob("*.py"):
        if path.parent.name == "effects" and path.name.endswith("_effects.py"):
            continue
        texts = (node for node in ast.walk(ast.parse(path.read_text("utf-8"))))
        strings = {n.value for n in texts if isinstance(n, ast.Constant)}
        assert not names & strings, path


def test_the_table_names_every_shipped_effect() -> None:
    """A new effect must be counted here as well; what depends on the matrices of others stands in
    `test_absorbing_layers.py`, `test_periodic_ends.py` and `test_axial_counting.py`."""
    elsewhere = {"absorbing_layers", "periodic_ends", "axial_motion", "tensioners", "temperature"}
    elsewhere.add("lateral_motion")
    assert set(effects.registry()) == {"vertical", *elsewhere, *BLOCKS}


def test_lateral_motion_adds_a_plane_that_no_other_scene_has(mesh: LineMesh) -> None:
    """Unknowns of all nodes, wires, pendulums, bars, masses; of a scene without it no trace."""
    hanging = frozenset({"gravity", "dropper_mass", "clamp_mass", "arm_inertia", "arm_stiffness"})
    names, n = BARE | hanging, counts(mesh)
    without, _ = find_form(full_problem(names), mesh)
    model, form = find_form(full_problem(names | {"lateral_motion"}), mesh)
    assert without.unknowns == ("w", "theta_y") and without.simulated.lateral is False
    assert model.unknowns == ("w", "theta_y", "v", "theta_z") and model.form is form
    assert model.n_dofs == 2 * without.n_dofs
    half = n["elements"] // 2
    assert contents(model) - contents(without) == {
        ("messenger_wire", half, True, True): 1,
        ("contact_wire", half, True, True): 1,
        # Geometric stiffness of droppers and of bars, and the bars themselves.
        ("droppers", n["droppers"], False, True): 1,
        ("steady_arms", n["arms"], False, True): 1,
        # Masses that move sideways.
        ("droppers", n["droppers"], True, False): 2,
        ("messenger_wire", n["droppers"], True, False): 1,
        ("contact_wire", n["droppers"], True, False): 1,
        ("steady_arms", n["arms"], True, False): 1,
    }
    # An arm that is a bar has no further stiffness.
    assert "arm_stiffness" in without.terms_of and "arm_stiffness" not in model.terms_of
    held = 2 * n["supports"] - n["supports"] + mesh.anchors.size
    assert model.constrained.size == without.constrained.size + held


@pytest.mark.parametrize("name", BLOCKS)
def test_an_effect_alone_adds_what_it_declares_and_nothing_else(name: str, mesh: LineMesh) -> None:
    bare, model = model_with(frozenset(), mesh), model_with(frozenset({name}), mesh)
    blocks, terms = BLOCKS[name]
    n = counts(mesh)
    added = contents(model) - contents(bare)
    assert added == {(part, n[size], *has): many for (part, size, *has), many in blocks.items()}
    assert not contents(bare) - contents(model)
    assert set(model.terms_of) == {"vertical", name}
    assert model.terms_of[name] == expected_terms(terms, n)
    assert model.terms_of["vertical"] == bare.terms_of["vertical"]
    assert model.unknowns == bare.unknowns
    assert np.array_equal(model.constrained, bare.constrained)
    assert model.weight.any() == (name == "gravity")
    assert model.dropper_damping.any() == (name == "structural_damping")
    # What was there before is the same to the bit; a dropper that carries nothing has no stiffness.
    for old, new in zip(bare.blocks, model.blocks, strict=False):
        if name in ("missing_dropper", "loose_clamp") and old.component == "droppers":
            assert old.stiffness is not None and new.stiffness is not None
            changed = (old.stiffness != new.stiffness).any(axis=(1, 2))
            assert np.flatnonzero(changed) == np.flatnonzero(model.broken)
            assert not new.stiffness[changed].any()
            continue
        assert np.array_equal(old.dofs, new.dofs) and np.array_equal(old.kind, new.kind)
        for ours, theirs in ((old.mass, new.mass), (old.stiffness, new.stiffness)):
            assert (ours is None and theirs is None) or np.array_equal(ours, theirs)


@pytest.mark.parametrize("name", BLOCKS)
def test_a_scene_without_an_effect_has_no_trace_of_it(name: str, mesh: LineMesh) -> None:
    others = frozenset(BLOCKS) - {name}
    everything, model = model_with(frozenset(BLOCKS), mesh), model_with(others, mesh)
    blocks, _ = BLOCKS[name]
    n = counts(mesh)
    assert name not in model.terms_of
    assert name not in model.active
    assert {k: v for k, v in everything.terms_of.items() if k != name} == model.terms_of
    missing = contents(everything) - contents(model)
    assert missing == {(part, n[size], *has): many for (part, size, *has), many in blocks.items()}
    assert model.n_dofs == everything.n_dofs


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("dropper_mass", lambda p: with_dropper(p, mass_per_length=0.0)),
        (
            "clamp_mass",
            lambda p: with_dropper(p, upper_clamp_mass=0.0, lower_clamp_mass=0.0),
        ),
        ("arm_stiffness", lambda p: with_arm(p, stiffness=0.0)),
        ("arm_inertia", lambda p: with_arm(p, mass_per_length=0.0, clamp_mass=0.0)),
        ("transition_spans", lambda p: with_line(p, transition_rise=0.0)),
        ("pre_sag", lambda p: with_line(p, pre_sag=((0.0,) * 9,) * N_SPANS)),
        ("structural_damping", lambda p: replace(p, damping=Damping(0.0, 0.0))),
        ("contact_damping", lambda p: replace(p, contact=LinearLaw(5e4, 0.0))),
        ("residual_dropper_stiffness", lambda p: replace(p, residual_stiffness_ratio=0.0)),
        (
            "several_pantographs",
            lambda p: replace(p, train=replace(p.train, placements=p.train.placements[:1])),
        ),
        ("head_roll", lambda p: replace(p, train=train(70.0, 60.0, 160.0))),
        ("vehicle_motion", lambda p: replace(p, train=replace(p.train, vehicle=None))),
        ("pantograph_aerodynamics", lambda p: replace(p, train=train(70.0, 60.0, 160.0))),
        ("wind", lambda p: replace(p, wind=None)),
        ("gusts", lambda p: replace(p, wind=WIND.with_gusts(None))),
        ("supercritical_speed", lambda p: replace(p, train=replace(p.train, speed=70.0))),
        ("fittings", lambda p: replace(p, line=replace(p.line, fittings=()))),
        *(
            (name, lambda p: replace(p, irregularities=Irregularities()))
            for name in ("contact_wire_height", "running_surface", "dropper_lengths")
        ),
        *(
            (name, lambda p: replace(p, defects=()))
            for name in (
                "missing_dropper",
                "loose_clamp",
                "worn_wire",
                "wrong_tension",
                "hard_spot",
                "kink",
            )
        ),
    ],
)
def test_an_effect_with_nothing_to_act_on_does_not_exist(
    name: str, change: object, mesh: LineMesh
) -> None:
    problem = full_problem(BARE | frozenset(BLOCKS))
    lengths = np.full(mesh.droppers.shape[0], 1.0)
    assert name in build(problem, mesh, lengths).terms_of
    assert name not in build(change(problem), mesh, lengths).terms_of


def with_line(problem: Problem, **changes: object) -> Problem:
    return replace(problem, line=make_line(replace(full_line(), **changes)))


def with_dropper(problem: Problem, **changes: float) -> Problem:
    return with_line(problem, dropper=replace(full_line().dropper, **changes))


def with_arm(problem: Problem, **changes: float) -> Problem:
    return with_line(problem, steady_arm=replace(full_line().steady_arm, **changes))


def test_weights_are_those_of_the_masses_that_exist(mesh: LineMesh) -> None:
    """Gravity acts on what the other effects hang on the line, half of a hinged arm included."""
    line, n = full_line(), counts(mesh)
    gravity = 9.81
    wires = line.support_positions[-1] * (
        line.contact_wire.mass_per_length + line.messenger_wire.mass_per_length
    )
    clamps = n["droppers"] * (line.dropper.upper_clamp_mass + line.dropper.lower_clamp_mass)
    droppers = n["droppers"] * line.dropper.mass_per_length * 1.0  # all 1 m long here
    arm = line.steady_arm
    arms = n["arms"] * (0.5 * arm.mass_per_length * arm.length + arm.clamp_mass)
    hanging = {
        frozenset(): wires,
        frozenset({"clamp_mass"}): wires + clamps,
        frozenset({"dropper_mass"}): wires + droppers,
        frozenset({"arm_inertia"}): wires + arms,
        frozenset({"clamp_mass", "dropper_mass", "arm_inertia"}): wires + clamps + droppers + arms,
    }
    for names, mass in hanging.items():
        model = model_with(names | {"gravity"}, mesh)
        vertical = model.weight[model.dofs(np.arange(mesh.n_nodes))]
        assert vertical.sum() == pytest.approx(-gravity * mass, rel=1e-13)


def test_form_finding_knows_pre_sag_and_transitions_only_if_asked(mesh: LineMesh) -> None:
    whole = BARE | {"gravity", "pre_sag", "transition_spans"}
    lower = mesh.droppers[:, 1]
    level, line = 5.08, full_line()
    sag = np.concatenate([np.asarray(span) for span in line.pre_sag])
    rise = line.target_height(mesh.x(lower)) - level
    for names, expected in (
        (whole, level + rise - sag),
        (whole - {"pre_sag"}, level + rise),
        (whole - {"transition_spans"}, level - sag),
        (BARE | {"gravity"}, np.full(lower.size, level)),
    ):
        _, form = find_form(full_problem(names), mesh)
        assert form.height[lower] == pytest.approx(expected, abs=1e-14)
    _, form = find_form(full_problem(BARE), mesh)
    assert not form.dropper_force.any()


def test_point_masses_are_those_of_the_parts(mesh: LineMesh) -> None:
    """Half a dropper at either end, clamps, and a third of an arm that is hinged at its far end."""
    line, n = full_line(), counts(mesh)
    kind, arm = line.dropper, line.steady_arm
    lengths = np.linspace(0.8, 1.2, n["droppers"])
    sound = frozenset(BLOCKS) - {"fittings", "missing_dropper", "hard_spot"}
    whole = build(full_problem(BARE | sound), mesh, lengths)
    bare = build(full_problem(BARE), mesh, lengths)
    dofs = whole.dofs(np.arange(mesh.n_nodes))

    def masses(model: Model) -> np.ndarray:
        diagonal = np.zeros(model.n_dofs)
        for block in model.blocks:
            if block.mass is not None:
                of_kinds = np.diagonal(block.mass, axis1=1, axis2=2)
                np.add.at(diagonal, block.dofs, of_kinds[block.kind])
        return diagonal[dofs]

    expected = np.zeros(mesh.n_nodes)
    upper, lower = mesh.droppers.T
    expected[upper] = kind.upper_clamp_mass + 0.5 * kind.mass_per_length * lengths
    expected[lower] = kind.lower_clamp_mass + 0.5 * kind.mass_per_length * lengths
    # Kinetic energy of a hinged rod: its moment of inertia m l^2 / 3 turned into a mass at its end.
    expected[mesh.steady_arms] += arm.mass_per_length * arm.length / 3 + arm.clamp_mass
    assert masses(whole) - masses(bare) == pytest.approx(expected, abs=1e-13)


def test_droppers_are_springs_of_their_stiffness_or_of_their_length(mesh: LineMesh) -> None:
    lengths = np.linspace(0.8, 1.2, mesh.droppers.shape[0])
    given = full_problem(BARE)
    by_length = with_dropper(given, stiffness=None, axial_stiffness=8e4)
    assert build(given, mesh, lengths).dropper_stiffness == pytest.approx(1e5)
    model = build(by_length, mesh, lengths)
    assert model.dropper_stiffness == pytest.approx(8e4 / lengths, rel=1e-15)
    (links,) = [block for block in model.blocks if block.component == "droppers"]
    assert links.stiffness[3, 0, 1] == pytest.approx(-8e4 / lengths[3], rel=1e-15)
    damped = replace(given, effects=BARE | {"structural_damping"})
    alpha = given.damping.alpha
    assert build(damped, mesh, lengths).dropper_damping == pytest.approx(alpha * 1e5, rel=1e-15)


def test_damping_may_differ_from_component_to_component(mesh: LineMesh) -> None:
    lengths = np.ones(mesh.droppers.shape[0])
    damping = Damping(1e-4, 0.01, {"droppers": (1e-3, 0.0)})
    on = replace(full_problem(BARE | {"structural_damping"}), damping=damping)
    model = build(on, mesh, lengths)
    assert model.damping_of("droppers") == (1e-3, 0.0)
    assert model.damping_of("contact_wire") == (1e-4, 0.01)
    assert not model.damping_is_proportional
    off = build(replace(on, effects=BARE), mesh, lengths)
    assert off.damping_of("droppers") == (0.0, 0.0)
    assert off.damping_is_proportional


def test_a_head_has_a_roll_only_if_asked() -> None:
    """As `Pantographs` asks: with where the wire crosses the strips, or without."""
    data = replace(EN_PANTOGRAPH, roll=Turning(2.0, 470.0, 1.0))
    operation = Operation(120.0, 5.5, 0.5, 1e-3, 0.25, 0.5)
    path = LateralPath(np.array([0.0, 100.0]), (0.2, 0.2), 0.0, (0.0,), 70.0)
    assert make_pantograph(data, operation).state().size == 6
    assert make_pantograph(data, operation._replace(lateral=path)).state().size == 9
