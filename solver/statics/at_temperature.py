"""The line at rest at another temperature than that of its installation.

Droppers keep the lengths by which they were cut. Wires grow by alpha dT, their ends move as far as
tensioners let them, droppers lean and arms swing, and both take tension off the wires. Newton's
method on the potential energy; its tangent is the stiffness of the model about each shape.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import linalg as sparse_linalg

from catenary.meshgen.wires import Wire
from catenary.solver.base.errors import InputError
from catenary.solver.effects.build_model import build
from catenary.solver.model.axial_elements import slope_rows, unknowns_along
from catenary.solver.model.elements import beam
from catenary.solver.model.model import Block, Model
from catenary.solver.model.rest.rest_shape import Equilibrium
from catenary.solver.model.wire_ends import WireEnd, tensioned_ends

# Displacements change by less than this where Newton's method ends [m].
_SETTLED = 1e-9
_MOST_STEPS, _MOST_STATES = 40, 40
# Forces that are one [N].
_TINY = 1e-6


def at_temperature(model: Model, installed: Equilibrium) -> Equilibrium:
    """The line at rest at the model's temperature. Not collective.

    Parameters
    ----------
    model : about ``installed``, the shape at the installation

    Raises
    ------
    InputError
        If there is no rest, or a dropper would be slack there.
    """
    warm = _WarmLine(model, installed)
    ends = [_End(model, end) for end in _with_tensioner(model)]
    form = installed
    for _ in range(_MOST_STATES):
        form = warm.at_rest(form, ends)
        tension = [warm.tension_at(form, end.end) for end in ends]
        changed = [end.changes(form, own) for end, own in zip(ends, tension, strict=True)]
        if not any(changed):
            _check(model, form)
            return form
    raise InputError(
        f"the line finds no rest at {_kelvin(model)}: its tensioners start and stop without end"
    )


class _End:
    """A tensioned end: whether its wheel stands, turns at an edge of its band, or is at a stop.

    Attributes
    ----------
    end : WireEnd
    pull : force that the tensioner has while it turns, None while the end is held [N]
    held_at : place outwards at which it is held otherwise [m]
    """

    def __init__(self, model: Model, end: WireEnd) -> None:
        tensioner, wire = model.simulated.tensioner, model.problem.line.wire(end.wire)
        assert tensioner is not None
        self.end, self._travel = end, tensioner.travel
        self._low, self._high = tensioner.band(end.wire, wire, model.problem.gravity)
        self.pull = wire.tension if tensioner.turns else None
        self.held_at = 0.0

    def outwards(self, form: Equilibrium) -> float:
        """How far the end has moved away from its wire [m]."""
        return self.end.outwards * float(form.along[self.end.node])

    def changes(self, form: Equilibrium, tension: float) -> bool:
        """Go over to the state that follows at this rest; returns whether it is another one."""
        before = self.pull, self.held_at
        if self.pull is None:
            # A stop takes up what the weights pull more, and keeps what the wire pulls more.
            if tension < self._low - _TINY and self.held_at <= 0.0:
                self.pull = self._low
            elif tension > self._high + _TINY and self.held_at >= 0.0:
                self.pull = self._high
        elif self._travel is not None and abs(self.outwards(form)) > self._travel:
            self.held_at = float(np.copysign(self._travel, self.outwards(form)))
            self.pull = None
        return (self.pull, self.held_at) != before


class _WarmLine:
    """A line that is warmer than at its installation, and the forces that its shape lacks."""

    def __init__(self, model: Model, installed: Equilibrium) -> None:
        self._model, self._installed = model, installed
        self._warmer = model.simulated.warmer
        line = model.problem.line
        own = {wire.name for wire in line.wires} | {group.name for group in line.droppers}
        # All that is linear in the displacement: supports, arms, clamps.
        self._springs = [b for b in model.blocks if b.stiffness is not None]
        self._springs = [b for b in self._springs if b.component not in own]
        self._wires = [_WarmWire(model, wire, installed, self._warmer) for wire in line.wires]

    def at_rest(self, form: Equilibrium, ends: list[_End]) -> Equilibrium:
        """The rest from a shape nearby, with tensioned ends in these states."""
        model = self._model
        numbers = {end.end.node: int(model.dofs(np.array([end.end.node]), "u")[0]) for end in ends}
        free = [numbers[end.end.node] for end in ends if end.pull is not None]
        held = [numbers[end.end.node] for end in ends if end.pull is None]
        constrained = np.union1d(np.setdiff1d(model.constrained, free), held).astype(np.int64)
        pulls = np.zeros(model.n_dofs)
        moved = self._displacement(form)
        for end in ends:
            number, outwards = numbers[end.end.node], end.end.outwards
            if end.pull is None:
                moved[number] = outwards * end.held_at
            else:
                tension = model.problem.line.wire(end.end.wire).tension
                pulls[number] += outwards * (end.pull - tension)
        change = np.inf
        for _ in range(_MOST_STEPS):
            form = self._form(moved)
            if change < _SETTLED:
                return form
            about = build(model.problem, model.mesh, model.dropper_lengths, form=form)
            about.constrained = constrained
            lacks = pulls - self._pull_back(moved, form)
            lacks[constrained] = 0.0
            from catenary.solver.model.matrices import whole_matrix  # loads PETSc

            tangent = whole_matrix(about, stiffness=1.0, held_diagonal=1.0)
            step = sparse_linalg.spsolve(tangent, lacks)
            if not np.isfinite(step).all():
                break
            moved += step
            change = float(np.abs(step).max())
        raise InputError(
            f"the line finds no rest at {_kelvin(model)}: it still moves by {change:.2g} m after "
            f"{_MOST_STEPS} steps of Newton's method; its wires may be slack there"
        )

    def tension_at(self, form: Equilibrium, end: WireEnd) -> float:
        """Tension of the last element at an end of a wire [N]."""
        pairs = self._model.mesh.elements(end.wire)
        number = int(np.flatnonzero((pairs == end.node).any(axis=1))[0])
        wire = self._model.problem.line.wire(end.wire)
        at = self._model.mesh.x(pairs[number]).mean()
        return float(wire.tension_at(at) + form.gained_tension[end.wire][number])

    def _displacement(self, form: Equilibrium) -> np.ndarray:
        """What has moved since the installation, (n_dofs,)."""
        model, every = self._model, np.arange(self._model.mesh.n_nodes)
        moved = np.zeros(model.n_dofs)
        moved[model.dofs(every)] = form.height - self._installed.height
        moved[model.dofs(every, "theta_y")] = form.slope - self._installed.slope
        if form.along.size:
            moved[model.dofs(every, "u")] = form.along
        return moved

    def _form(self, moved: np.ndarray) -> Equilibrium:
        """The shape after a displacement, with the forces that belong to it."""
        model, was = self._model, self._installed
        mesh, every = model.mesh, np.arange(model.mesh.n_nodes)
        form = replace(
            was,
            height=was.height + moved[model.dofs(every)],
            slope=was.slope + moved[model.dofs(every, "theta_y")],
            along=moved[model.dofs(every, "u")],
            gained_tension={own.name: own.gained(moved) for own in self._wires},
        )
        upper, lower = mesh.droppers.T
        length = np.hypot(form.leaning(mesh.droppers), form.height[upper] - form.height[lower])
        carries = was.dropper_force != 0.0
        force = model.dropper_stiffness * (length - was.dropper_length)
        return replace(form, dropper_force=np.where(carries, force, 0.0))

    def _pull_back(self, moved: np.ndarray, form: Equilibrium) -> np.ndarray:
        """Gradient of the potential energy less that at the installation, (n_dofs,) [N]."""
        model, was = self._model, self._installed
        total = np.zeros(model.n_dofs)
        for block in self._springs:
            _add_springs(total, block, moved)
        for wire in self._wires:
            wire.add_pull(total, moved)
        pairs = model.mesh.droppers
        upper, lower = pairs.T
        drop, lean = form.height[upper] - form.height[lower], form.leaning(pairs)
        per_length = form.dropper_force / np.hypot(drop, lean)
        for name, pull in (("w", per_length * drop - was.dropper_force), ("u", per_length * lean)):
            np.add.at(total, model.dofs(upper, name), pull)
            np.add.at(total, model.dofs(lower, name), -pull)
        return total


class _WarmWire:
    """The elements of a wire: their tension, and how they pull at their nodes."""

    def __init__(self, model: Model, wire: Wire, installed: Equilibrium, warmer: float) -> None:
        pairs = model.mesh.elements(wire.name)
        self.name = wire.name
        self._length = np.diff(model.mesh.x(pairs), axis=1)[:, 0]
        self._unknowns = unknowns_along(model, wire.name)
        assert wire.axial_stiffness is not None
        self._axial, self._grown = wire.axial_stiffness, wire.expansion * warmer
        shape = np.stack([installed.height[pairs], installed.slope[pairs]], axis=2)
        self._shape = shape.reshape(-1, 4)
        self._tension = wire.tension_at(model.mesh.x(pairs).mean(axis=1))
        self._bending = beam.stiffness(self._length, wire.bending_stiffness, 0.0)

    def gained(self, moved: np.ndarray) -> np.ndarray:
        """Tension of each element beside that of the installation [N]."""
        u1, u2, *bent = moved[self._unknowns].T
        rows = slope_rows(self._length, self._shape + 0.5 * np.array(bent).T)
        strain = (u2 - u1) / self._length + (rows * np.array(bent).T).sum(axis=1)
        return np.asarray(self._axial * (strain - self._grown))

    def add_pull(self, total: np.ndarray, moved: np.ndarray) -> None:
        """Add the gradient of its energy less that at the installation to ``total``."""
        gained, bent = self.gained(moved), moved[self._unknowns[:, 2:]]
        across = np.einsum("nij,nj->ni", self._bending, bent)
        unit = self._length[:, None]
        across += (self._tension[:, None] * unit) * slope_rows(self._length, bent)
        across += (gained[:, None] * unit) * slope_rows(self._length, self._shape + bent)
        along = np.stack([-gained, gained], axis=1)
        np.add.at(total, self._unknowns, np.concatenate([along, across], axis=1))


def _with_tensioner(model: Model) -> list[WireEnd]:
    return tensioned_ends(model) if model.simulated.tensioner is not None else []


def _add_springs(total: np.ndarray, block: Block, moved: np.ndarray) -> None:
    assert block.stiffness is not None
    pull = np.einsum("nij,nj->ni", block.stiffness[block.kind], moved[block.dofs])
    np.add.at(total, block.dofs, pull)


def _kelvin(model: Model) -> str:
    warmer = model.simulated.warmer
    return f"{abs(warmer):g} K {'above' if warmer > 0 else 'below'} its installation"


def _check(model: Model, form: Equilibrium) -> None:
    slack = np.flatnonzero((form.dropper_force <= 0.0) & form.dropper_force.any())
    if slack.size:
        x = model.mesh.x(model.mesh.droppers[slack, 1])
        more = f", and so would {slack.size - 1} more" if slack.size > 1 else ""
        raise InputError(
            f"the dropper at {x[0]:.2f} m would be slack at {_kelvin(model)} (force "
            f"{form.dropper_force[slack[0]]:.1f} N){more}: change line.temperature.difference_K, "
            "or what lets the wires move along the track"
        )
    for name, gained in form.gained_tension.items():
        wire, pairs = model.problem.line.wire(name), model.mesh.elements(name)
        middle = model.mesh.x(pairs).mean(axis=1)
        left = wire.tension_at(middle) + gained
        if left.min() <= 0.0:
            raise InputError(
                f"{name} would be slack at {_kelvin(model)} (tension {left.min():.0f} N at "
                f"{middle[left.argmin()]:.1f} m): give its end a tensioner (line.ends, "
                "line.tensioner), or change line.temperature.difference_K"
            )
