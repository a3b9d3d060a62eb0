"""Effects of motion: sideways, along the track, and at the ends of a line.

Wires, droppers as pendulums, clamps and steady arms as pinned bars move sideways; along the track
wires stretch, by tensioners and temperature; a line ends in layers that absorb waves, or goes on.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.wires import SAME_PLACE, End
from catenary.solver.effects.effect import Effect
from catenary.solver.model import axial_motion
from catenary.solver.model.alike import alike
from catenary.solver.model.link_directions import across_droppers, sideways_of_droppers
from catenary.solver.model.links import PULLS, PUSHES, Direction, law, slips
from catenary.solver.model.model import Block, Model
from catenary.solver.model.unknowns import LEVEL
from catenary.solver.problem.ends import AbsorbingLayer, Periodic
from catenary.solver.problem.integrator_parameters import integration_of
from catenary.solver.problem.problem import Problem, Simulated, steps_of

if TYPE_CHECKING:
    from catenary.meshgen.line import SteadyArms
    from catenary.solver.model.builder import ModelBuilder

AXIAL = "axial_motion"
# Components: tensioners in the damping, and their stops, of weights at their lowest and highest.
TENSIONERS = "tensioners"
_LOWEST, _HIGHEST = "tensioner_stops_down", "tensioner_stops_up"
# Of wheels that slip as the wire pulls them, and as the weights do.
_GIVES, _TAKES = "tensioner_slips_in", "tensioner_slips_out"
# Speed of a wheel that stands by friction, at the edge of its band [m/s].
CREEP = 1e-4
# Parts of unit vectors along the track below this are none: round-off [-].
_UPRIGHT = 1e-9
# The component that lines beyond an end are in the damping: the line's.
_BEYOND = "line_beyond"


def _lateral(builder: ModelBuilder) -> None:
    mesh, model = builder.mesh, builder.model
    for wire in reversed(builder.problem.line.wires):
        builder.add_wire(wire.name, LEVEL)
    builder.add_pendulums(*sideways_of_droppers(model))
    builder.add_clamps("v")
    on_bars = np.zeros(mesh.steady_arms.size, dtype=bool)
    for arms, mine in model.arms_by_group():
        if arms.kind.length > 0.0:
            on_bars |= mine
            _bars(builder, arms, mine)
    held = np.concatenate([mesh.supports, mesh.steady_arms[~on_bars], builder.held_ends])
    builder.hold(np.setdiff1d(held, mesh.steady_arms[on_bars]), "v")


def _bars(builder: ModelBuilder, arms: SteadyArms, mine: np.ndarray) -> None:
    """Bars from the wire to hinges: stiff along themselves, P/l across."""
    name, length = arms.name, arms.kind.length
    model, nodes = builder.model, builder.mesh.steady_arms[mine]
    unit, tension = np.tile([1.0, 0.0, 0.0], (nodes.size, 1)), np.zeros(nodes.size)
    if model.form is not None and model.form.lateral is not None:
        shape = model.form.lateral
        unit, tension = shape.arm_direction[mine], shape.arm_tension[mine]
    # Along the track an arm that has not swung out does nothing but swing.
    swings = "u" in model.unknowns
    slewed = swings and bool((np.abs(unit[:, 2]) > _UPRIGHT).any())
    names = ("v", "w", "u") if slewed else ("v", "w")
    unit = unit[:, : len(names)]
    unknowns = np.stack([model.dofs(nodes, one) for one in names], axis=1)
    laws = law(builder.mesh.x(nodes), arms.kind.bar_stiffness, rest=tension)
    builder.add_links(name, Direction(unknowns, -unit), laws, of_shape=True)
    across = np.eye(len(names)) - unit[:, :, None] * unit[:, None, :]
    pull = (tension / length)[:, None, None]
    builder.add_elements(name, unknowns, stiffness=pull * across, of_shape=True)
    if swings and not slewed:
        along = model.dofs(nodes, "u")[:, None]
        builder.add_elements(name, along, stiffness=pull, of_shape=True)


LATERAL = Effect(
    "lateral_motion",
    "lateral motion of the wires, with steady arms as pinned bars",
    "lateral bending, tension and mass of all wires; droppers as pendulums, arms as bars",
    "tensioned beam in the lateral plane; bars with geometric stiffness",
    default=False,
    unknowns_of_wire=lambda wire: LEVEL,
    build=_lateral,
    of_form=True,
    law=lambda laws, p: replace(laws, lateral=True),
)


def moves_along(problem: Problem) -> bool:
    """Whether the wires of a problem move along the track."""
    return AXIAL in problem.effects


def _axial(builder: ModelBuilder) -> None:
    for wire in builder.problem.line.wires:
        _add_bars(builder, wire.name)
    builder.add_pendulums(*across_droppers(builder.model))
    _add_swinging_arms(builder)
    builder.add_clamps("u")
    builder.hold(axial_motion.held_along(builder.model), "u")


def _add_bars(builder: ModelBuilder, name: str) -> None:
    """Stiffness and mass of a wire along the track."""
    model, data = builder.model, builder.problem.line.wire(name)
    if data.axial_stiffness is None:
        raise ValueError(f"{name} has no axial stiffness")
    unknowns = axial_motion.unknowns_along(model, name)
    rows = axial_motion.strain_rows(model, name)
    left, _ = data.left_of(model.mesh.x(model.mesh.elements(name)))
    first, kind = alike(np.column_stack([rows, left]))
    rows, left = rows[first], left[first]
    length = 1.0 / rows[:, 1]
    stiffness = (data.axial_stiffness * left * length)[:, None, None] * (
        rows[:, :, None] * rows[:, None, :]
    )
    mass = np.zeros_like(stiffness)
    mass[:, :2, :2] = axial_motion.bar_mass(left * length, data.mass_per_length)
    builder.add_block(Block(name, unknowns, kind, mass, stiffness, of_shape=True))


def _add_swinging_arms(builder: ModelBuilder) -> None:
    """Arms swing along the track against their radial force."""
    model, line = builder.model, builder.problem.line
    if model.simulated.lateral:
        return  # bars, which swing along the track as well
    for arms, mine in model.arms_by_group():
        radial = np.abs(line.wire(arms.wire).radial_force(np.array(arms.x)))
        if radial.any() and arms.kind.length > 0.0:
            nodes = model.mesh.steady_arms[mine]
            builder.add_springs(arms.name, nodes, "u", radial / arms.kind.length)


def _tensioners(builder: ModelBuilder) -> None:
    """Inertia of the weights, friction of the wheels and end stops."""
    model, problem = builder.model, builder.problem
    tensioner = model.simulated.tensioner
    assert tensioner is not None
    ends = [
        end for end in axial_motion.tensioned_ends(model) if not axial_motion.at_stop(model, end)
    ]
    if not ends:
        return
    nodes = np.array([end.node for end in ends])
    inertia = [
        tensioner.inertia(end.wire, problem.line.wire(end.wire), problem.gravity) for end in ends
    ]
    builder.add_masses(TENSIONERS, nodes, np.array(inertia), unknown="u")
    if not tensioner.turns:
        _add_friction(builder, ends)
    if tensioner.travel is None:
        return
    # Stretch is how far an end is outwards: from there on weights sink no further.
    sign = np.array([float(end.outwards) for end in ends])
    moved = np.zeros(len(ends)) if model.form is None else sign * model.form.moved_along(nodes)
    direction = Direction(model.dofs(nodes, "u")[:, None], sign[:, None])
    for stop, acts, way in ((_LOWEST, PULLS, -moved), (_HIGHEST, PUSHES, moved)):
        gap = np.maximum(tensioner.travel + way, 0.0)
        laws = law(builder.mesh.x(nodes), tensioner.stop_stiffness, acts=acts, gap=gap)
        builder.add_links(stop, direction, laws)


def _add_friction(builder: ModelBuilder, ends: list[axial_motion.WireEnd]) -> None:
    """Dry friction of wheels: a damper that slips where the tension leaves the band of a wheel that
    stands. While one stands it creeps, by ``CREEP`` where half the band is used."""
    model, problem = builder.model, builder.problem
    tensioner = model.simulated.tensioner
    assert tensioner is not None
    nodes = np.array([end.node for end in ends])
    unknowns = model.dofs(nodes, "u")[:, None]
    low, high, tension = np.array(
        [
            (
                *tensioner.band(end.wire, problem.line.wire(end.wire), problem.gravity),
                axial_motion.tension_at_rest(model, end),
            )
            for end in ends
        ]
    ).T
    damping = 0.5 * (high - low) / CREEP
    builder.add_elements(TENSIONERS, unknowns, damping=damping[:, None, None])
    outwards = np.array([[float(end.outwards)] for end in ends])
    x = builder.mesh.x(nodes)
    # A wire that pulls more than the band allows moves inwards, one that pulls less outwards.
    for name, sign, left in ((_GIVES, 1.0, high - tension), (_TAKES, -1.0, tension - low)):
        laws = slips(x, np.maximum(left, 0.0), damping)
        builder.add_links(name, Direction(unknowns, sign * outwards), laws, of_shape=True)


def _has_tensioner(problem: Problem) -> bool:
    along, masts = problem.along, problem.line.support_positions[[0, -1]]
    line_ends = float(masts[0]), float(masts[1])
    has_one = any(
        along.tensioned(piece.x[end], line_ends, SAME_PLACE)
        if piece.tensioned[end] is None
        else piece.tensioned[end]
        for wire in problem.line.wires
        for piece in wire.pieces
        for end in (0, -1)
        if piece.ends[end] is not End.CLAMPED
    )
    return AXIAL in problem.effects and has_one


ALONG_TRACK = (
    Effect(
        AXIAL,
        "motion of the wires along the track",
        "places along the track, stretch of wires, droppers and arms that swing along the track",
        "mean strain of a bar about its shape at rest (Washizu 1982)",
        default=False,
        unknowns_of_wire=lambda wire: ("u",),
        applies=lambda p: all(wire.axial_stiffness is not None for wire in p.line.wires),
        data="axial_stiffness_N, or section_mm2 and youngs_modulus_GPa, of every wire",
        build=_axial,
        of_form=True,
    ),
    Effect(
        "tensioners",
        "tensioners at the ends of wires",
        "inertia of weights and stops at their ends of travel; line.tensioner",
        "weights on a wheel with friction",
        applies=_has_tensioner,
        data="line.ends or line.overlap with along = tensioner, and effects.axial_motion",
        build=_tensioners,
        components=(TENSIONERS, _LOWEST, _HIGHEST),
        law=lambda laws, p: replace(laws, tensioner=p.along.tensioner),
    ),
    Effect(
        "temperature",
        "another temperature than that of the installation",
        "growth of the wires, droppers that lean and arms that swing at rest; line.temperature",
        "potential energy of wires and droppers of given lengths",
        applies=lambda p: AXIAL in p.effects and p.along.warmer != 0.0,
        data="line.temperature.difference_K other than 0, and effects.axial_motion",
        law=lambda laws, p: replace(laws, warmer=p.along.warmer),
        of_form=True,
        after_cutting=True,
    ),
)


def layer_damping(x: np.ndarray, begin: float, end: float, damping: float) -> np.ndarray:
    """Damping per mass of a layer at places along the track, shape as ``x`` [1/s].

    It grows from zero at ``begin`` to ``damping`` [1/s] at ``end`` as the square of the way into
    the layer, and is zero on the other side of ``begin``. The layer may lie to either side: ``end``
    may be less than ``begin`` [m]. Beyond ``end`` it stays as it is there. Not collective.
    """
    into = np.clip((x - begin) / (end - begin), 0.0, 1.0)
    return np.asarray(damping * into**2)


def layer_blocks(model: Model, begin: float, end: float, damping: float) -> list[Block]:
    """Damping blocks of an absorbing layer, for all masses that the model has so far.

    ``begin`` and ``end`` [m] and ``damping`` [1/s] are those of ``layer_damping``; an element takes
    the value at its middle. Not collective.
    """
    x = model.numbering.as_vector(model.mesh.points[:, :1])
    found = []
    for block in model.blocks:
        if block.mass is None:
            continue
        rate = layer_damping(x[block.dofs].mean(axis=1), begin, end, damping)
        inside = np.flatnonzero(rate > 0.0)
        if inside.size:
            matrices = rate[inside, None, None] * block.mass[block.kind[inside]]
            dofs = block.dofs[inside]
            found.append(Block.of_elements(block.component, dofs, damping=matrices))
    return found


def _layers(builder: ModelBuilder) -> None:
    masts, n = builder.problem.line.support_positions, builder.problem.line.n_spans
    for end, (last, step) in zip(builder.problem.ends, ((0, 1), (n, -1)), strict=True):
        if isinstance(end, AbsorbingLayer):
            begin, outer = masts[last + step * end.n_spans], masts[last]
            for block in layer_blocks(builder.model, float(begin), float(outer), end.damping):
                builder.add_block(block)


def _going_on(laws: Simulated, problem: Problem) -> Simulated:
    start, end = (isinstance(end, Periodic) for end in problem.ends)
    return replace(laws, goes_on=(start, end))


def _lines_beyond(builder: ModelBuilder) -> None:
    # Compiled loops and transforms, which lines that do not go on need not import.
    from catenary.solver.ends import SIDES, StepSums, line_beyond, periodic_end
    from catenary.solver.model.loads import MemoryLoad

    model, problem = builder.model, builder.problem
    numerics, damping = problem.numerics, model.damping_of(_BEYOND)
    integration = integration_of(
        numerics.integrator, numerics.spectral_radius, numerics.beta, numerics.gamma
    )
    sums, ends = StepSums(numerics.dt, integration), []
    for side, goes_on in enumerate(model.simulated.goes_on):
        if goes_on:
            beyond = line_beyond(model, side, builder.held)
            builder.hold_unknowns(beyond.held)
            try:
                ends.append(periodic_end(beyond, side, damping, sums))
            except InputError as error:
                raise InputError(
                    f"line.ends.{SIDES[side]}.kind is periodic, but this line cannot go on: "
                    f"{error}, as where nothing holds a wire"
                ) from error
    for end in ends:  # once both are found, as these are no part of what goes on
        mass, stiffness = end.mass[None], end.stiffness[None]
        builder.add_elements(_BEYOND, end.unknowns[None], mass=mass, stiffness=stiffness)
        builder.add_load(MemoryLoad(end.unknowns, numerics.dt, steps_of(problem), end.memory))


def _has(problem: Problem, kind: type) -> bool:
    return any(isinstance(end, kind) for end in problem.ends)


ENDS = (
    Effect(
        "absorbing_layers",
        "spans at the ends that absorb waves",
        "damping on mass that grows towards the end; line.ends",
        "graded absorbing layer, b (x/l)^2 M",
        applies=lambda p: _has(p, AbsorbingLayer),
        build=_layers,
        data="line.ends with an end of kind absorbing_layer",
    ),
    Effect(
        "periodic_ends",
        "lines that go on beyond their ends",
        "stiffness, mass and memory of the periodic line beyond; line.ends",
        "Bloch waves of a span; convolution quadrature (Lubich 1988)",
        applies=lambda p: _has(p, Periodic),
        build=_lines_beyond,
        law=_going_on,
        data="line.ends with an end of kind periodic",
    ),
)
