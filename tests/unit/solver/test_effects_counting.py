"""What a scene leaves out does not exist: counted in the model, one effect at a time."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from counted_effects import (
    N_SPANS,
    WIND,
    contents,
    counts,
    full_line,
    full_problem,
    model_with,
    with_arm,
    with_dropper,
    with_line,
)
from small_lines import BARE, EN_PANTOGRAPH, mesh_of, train

from catenary.mbs.build import Operation, make_pantograph
from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import Turning
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build
from catenary.solver.effects.effect import Limit
from catenary.solver.model.model import Model
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.defects import Irregularities, TensionLoss
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form

# --- what a scene leaves out does not exist -------------------------------------------------------


def expected_terms(terms: object, n: dict[str, int]) -> int:
    """A number, a multiple of a count, or multiples of several counts."""
    if isinstance(terms, dict):
        return sum(factor * n.get(size, 1) for size, factor in terms.items())
    return terms if isinstance(terms, int) else terms[1] * n[terms[0]]


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(full_line(), 2)


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
    "raked_strips": ({}, 1),
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
    "uplift_stops": ({("arm_stops", "arms", False, True): 1}, {"arms": 1, "laws": 1}),
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
    "raked_strips": "raked_strips",
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
    "uplift_stops": "uplift_stops",
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


def test_incidents_are_simulated_in_their_order(mesh: LineMesh) -> None:
    both = model_with({"tension_loss", "dropper_break"}, mesh)
    assert both.simulated.incidents == both.problem.incidents
    (loss,) = model_with({"tension_loss"}, mesh).simulated.incidents
    assert isinstance(loss, TensionLoss)


def test_no_effect_is_found_by_its_name() -> None:
    """What an effect contributes is read from `Simulated` and the model, in all of the solver."""
    names = set(effects.registry()) - {"vertical", "gravity", "pre_sag"}
    for path in (Path(__file__).parents[3] / "solver").rglob("*.py"):
        if path.parent.name == "shipped":
            continue
        texts = (node for node in ast.walk(ast.parse(path.read_text("utf-8"))))
        strings = {n.value for n in texts if isinstance(n, ast.Constant)}
        assert not names & strings, path


def test_the_table_names_every_shipped_effect() -> None:
    """A new effect must be counted here as well; what depends on the matrices of others stands in
    `test_planes_counting.py`, `test_periodic_ends.py`, `test_planes_counting.py`; what twin wires
    have in `test_planes_counting.py`, stiff links in `test_planes_counting.py`."""
    elsewhere = {"absorbing_layers", "periodic_ends", "axial_motion", "tensioners", "temperature"}
    elsewhere |= {"lateral_motion", "relative_motion", "stiff_link_damping"}
    assert set(effects.registry()) == {"vertical", *elsewhere, *BLOCKS}


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
            was, now = old.stiffness[old.kind], new.stiffness[new.kind]
            changed = (was != now).any(axis=(1, 2))
            assert np.flatnonzero(changed) == np.flatnonzero(model.broken)
            assert not now[changed].any()
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


def test_a_head_has_a_roll_only_if_asked() -> None:
    """As `Pantographs` asks: with where the wire crosses the strips, or without."""
    data = replace(EN_PANTOGRAPH, roll=Turning(2.0, 470.0, 1.0))
    path = LateralPath([(np.array([0.0, 100.0]), (0.2, 0.2))], 0.0, (0.0,), 70.0)
    for lateral, size in ((None, 6), (path, 9)):
        operation = Operation(120.0, 5.5, Stepping(0.5, 1e-3, lateral=lateral))
        assert make_pantograph(data, operation).state().size == size


# --- weights, masses, pre-sag, springs and damping of a line, effect by effect --------------------


def test_a_slack_dropper_keeps_a_share_only_if_droppers_slacken(mesh: LineMesh) -> None:
    residual = {"residual_dropper_stiffness"}
    assert model_with(residual, mesh).simulated.kept_ratio == 1.0
    both = model_with(residual | {"dropper_slackening"}, mesh).simulated
    assert (both.slackening, both.kept_ratio) == (True, 0.01)


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
    profile = make_line(line).wire("contact_wire").profile
    assert profile is not None
    rise = profile.level(mesh.x(lower)) - level
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
