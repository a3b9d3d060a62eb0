"""Whether a run can start from the line at rest: stable, and with its wires above the strips.

K is a sum of element matrices. Wires under tension, springs, clamps and droppers add positive
semidefinite ones; a steady arm that its wire pushes adds (S / l) (1 - e e^T) with S < 0, and a wire
that is pushed along itself softens as well. Only lines with such parts are looked at. K is positive
definite if Cholesky's factorisation succeeds; otherwise the row in which it fails is the first
place along the track at which the line is unstable.
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError
from catenary.meshgen.wires import Role
from catenary.solver.model.model import Model
from catenary.solver.model.operator_bands import OperatorBands
from catenary.solver.model.rest_shape import Equilibrium


def refuse_unstable(model: Model) -> None:
    """Refuse a line whose rest, about which a model is made, is unstable. Not collective.

    Raises
    ------
    InputError
        With the place along the line, and the arm or wire there that is pushed.
    """
    if not _softens(model):
        return
    row = _first_unstable(model)
    if row is None:
        return
    x = _place_of(model, row)
    raise InputError(
        f"the line at rest is unstable near {x:.4g} m: {_pushed_near(model, x)}, and the wires do "
        "not hold it; take less wind, a larger line.stagger_m or other tensions"
    )


def _softens(model: Model) -> bool:
    """Whether any part has a negative stiffness."""
    wires = [wire.name for wire in model.problem.line.wires]
    if any((model.tension_of(name) < 0.0).any() for name in wires):
        return True
    # The matrix of a pushed bar has a negative diagonal, at a right angle to the bar.
    return any(
        (np.diagonal(block.stiffness, axis1=1, axis2=2) < 0.0).any()
        for block in model.blocks
        if block.of_shape and block.stiffness is not None and block.component not in wires
    )


def _first_unstable(model: Model) -> int | None:
    """The first unknown at which elimination along the track finds K indefinite, None if K is
    positive definite."""
    bands = OperatorBands(model, (0.0, 1.0, 0.0)).between(0, model.n_dofs)
    _, failed = linalg.lapack.dpbtrf(bands, lower=1)
    return None if failed == 0 else int(failed) - 1


def _place_of(model: Model, unknown: int) -> float:
    nodes, _ = np.nonzero(model.numbering.numbers == unknown)
    return float(model.mesh.x(nodes[:1])[0]) if nodes.size else 0.0


def _pushed_near(model: Model, x: float) -> str:
    """Name of the arm or wire that is pushed near a place [m], in words."""
    form, mesh = model.form, model.mesh
    if form is not None and form.lateral is not None:
        tension, places = form.lateral.arm_tension, mesh.x(mesh.steady_arms)
        pushed = np.flatnonzero(tension < 0.0)
        if pushed.size:
            arm = pushed[np.argmin(np.abs(places[pushed] - x))]
            return (
                f"its wire pushes the steady arm at {places[arm]:.4g} m with "
                f"{-tension[arm]:.0f} N, so that it folds over"
            )
    for wire in model.problem.line.wires:
        tension = model.tension_of(wire.name)
        if tension.min() < 0.0:
            return f"{wire.name} is pushed along itself with up to {-tension.min():.0f} N"
    return "its stiffness is not positive definite"


def refuse_lost_wire(model: Model, form: Equilibrium) -> None:
    """Refuse a line of several contact wires that all stand beside a pantograph's strips at rest,
    blown there by the wind. Not collective.

    A wire that is alone is followed beside the strips, which the report says.

    Raises
    ------
    InputError
        With the stretch of the run in which a head finds no wire.
    """
    wires = model.nodes_of(Role.CONTACT)
    if form.lateral is None or len(wires) == 1:
        return
    train, shape = model.problem.train, form.lateral
    halves = [place.data.strips.half_length for place in train.placements]
    half = np.nanmin([*halves, np.inf])
    trailing = max(place.behind for place in train.placements)
    x = np.unique(np.concatenate([model.mesh.x(nodes) for nodes in wires]))
    x = x[(x >= train.start - trailing) & (x <= train.end)]
    beside = np.full(x.size, np.inf)
    for wire, nodes in zip(model.problem.line.wires_of(Role.CONTACT), wires, strict=True):
        for piece in np.split(nodes, model.mesh.breaks.get(wire.name, [])):
            place = model.mesh.x(piece)
            aside = np.interp(x, place, np.abs(shape.y[piece]), left=np.inf, right=np.inf)
            beside = np.minimum(beside, aside)
    lost = np.flatnonzero(np.isfinite(beside) & (beside > half))
    if lost.size:
        worst = lost[np.argmax(beside[lost])]
        raise InputError(
            f"at rest the contact wire stands beside the strips at {_stretches(x, lost)}, by "
            f"most at {x[worst]:.4g} m: {beside[worst]:.3g} m from the track's axis, and strips "
            f"end at {half:.3g} m, so that a pantograph would lose it; take less wind, another "
            "line.stagger_m or shorter spans, or longer strips (pantographs.*.strips.length_m)"
        )


def _stretches(x: np.ndarray, lost: np.ndarray) -> str:
    """Stretches of consecutive places, in words."""
    runs = np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1)
    first = runs[0]
    more = f" and in {len(runs) - 1} more stretches" if len(runs) > 1 else ""
    return f"{x[first[0]]:.4g} to {x[first[-1]]:.4g} m{more}"
