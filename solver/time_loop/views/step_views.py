"""Views for observers: what a run is made of, and the row and the state after each step.

A row has the values of all channels one after another. First stands what pantographs keep in one
array, then arms and droppers: a step fills these parts as a whole. What other channels take from
arrays elsewhere is copied behind them, number by number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from catenary.base.parallel import total
from catenary.meshgen.mesh import DROPPERS
from catenary.solver.contact.forces_on_line import FollowedLinks, ForcesOnLine
from catenary.solver.contact.pantographs import Pantographs
from catenary.solver.kernels import native
from catenary.solver.model.gauges import Gauges, gauges_of
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.switching_links import NO_LINKS, padded, some_of
from catenary.solver.problem.watched_links import GAUGES
from catenary.solver.schemes.scheme import Scheme
from catenary.solver.statics.after_incidents import ChangedLine
from catenary.solver.time_loop.views.channels import (
    CHANNELS,
    Energies,
    Sources,
    TrainLayout,
    energies_follow_motion,
    energies_of,
)
from catenary.solver.time_loop.views.checkpoints import Checkpoints, State
from catenary.solver.time_loop.views.observers import Stage, StepView
from catenary.solver.time_loop.views.shown_line import LineEnergy, ShownMotion
from catenary.solver.window.moving_columns import MovingColumns, columns_of

# Parts of a step that can be seen, more with each.
_ROW, _MOTION, _STATE = range(3)
# Channels of the first tables of ``shown.columns``.
_OF_COLUMNS = ("arm_uplift", "dropper_force")


class RowLayout:
    """Layout of a row: part of each channel, and its source. Not collective.

    Attributes
    ----------
    columns : name of a channel -> its part of a row
    width : numbers of a row
    copied : arrays (n,) that stand behind the first numbers, one after another
    in_loop : whether copies fill a row; not if a channel is a function

    Parameters
    ----------
    sources : of the channels, of which ``arm_uplift`` and ``dropper_force`` are parts of ``shown``
    shown : (n,) what pantographs, arms and droppers show

    Raises
    ------
    ValueError
        If the values of a channel are no contiguous doubles.
    """

    def __init__(self, sources: Sources, shown: np.ndarray) -> None:
        self.columns: dict[str, slice] = {}
        self._copied: list[tuple[slice, np.ndarray]] = []
        self._called: list[tuple[slice, Callable[[], np.ndarray]]] = []
        self.width = shown.size
        self.copied: list[np.ndarray] = []
        for channel in CHANNELS.values():
            assert channel.values is not None
            values = channel.values(sources)
            array = values if isinstance(values, np.ndarray) else np.asarray(values())
            part = _part_of(shown, sources, array)
            if part is None:
                part = slice(self.width, self.width + array.size)
                self.width = part.stop
                if isinstance(values, np.ndarray):
                    if array.dtype != np.float64 or not array.flags.c_contiguous:
                        raise ValueError(
                            f"the values of channel {channel.name} are no contiguous doubles"
                        )
                    self.copied.append(array.reshape(-1))
                    self._copied.append((part, array))
                else:
                    self._called.append((part, values))
            self.columns[channel.name] = part
        self.in_loop = not self._called

    def fill(self, row: np.ndarray) -> None:
        """Fill in what stands behind the first numbers of a row."""
        for part, array in self._copied:
            row[part] = array
        for part, values in self._called:
            row[part] = values()


def _part_of(shown: np.ndarray, sources: Sources, array: np.ndarray) -> slice | None:
    """Place of an array in the row that a step shows, None if it is not a part of it."""
    for whole in (shown, sources.pantographs.outputs):
        begin = array.ctypes.data - whole.ctypes.data
        if 0 <= begin and begin + array.nbytes <= whole.nbytes and array.flags.c_contiguous:
            return slice(begin // 8, begin // 8 + array.size)
    return None


class Showing:
    """The marched line and train as observers see them, from the arrays that the march steps.

    Parameters
    ----------
    comm : mpi4py communicator
    line, form : the line as it is now, and its first rest, from which displacements count
    moving : kept up to date for those who watch

    Attributes
    ----------
    shown : ``native.Shown``, of the rank's part of the line
    layout : of a row of a view
    motion : ShownMotion
    checkpoints : Checkpoints
    """

    def __init__(
        self,
        comm: Any,
        line: ChangedLine,
        form: Equilibrium,
        interaction: ForcesOnLine,
        pantographs: Pantographs,
        scheme: Scheme,
        moving: MovingColumns,
    ) -> None:
        self._comm, self._moving = comm, moving
        model = line.model
        self._model = model
        self._changed = line
        self._form = form
        self._interaction = interaction
        self._pantographs = pantographs
        self._line = interaction.line
        self.checkpoints = Checkpoints(comm, model, self._line, pantographs, scheme)
        self._unbalanced = bool(line.load.any())
        first, owned = self._line.ownership.first, self._line.ownership.owned
        arms = model.dofs(model.mesh.steady_arms)
        self._owned_arms = np.flatnonzero(owned(arms))
        self._arm_rows = (arms[self._owned_arms] - first).astype(np.int64)
        # Half as long as other numbers, since a line has very many.
        nodes = np.arange(model.mesh.n_nodes, dtype=np.int32)
        self._owned_nodes = nodes[owned(model.dofs(nodes))]
        n_outputs, n_arms = pantographs.outputs.size, self._arm_rows.size
        self._owned_droppers, droppers, dropper_bends = interaction.links.shown(DROPPERS)
        self._shown = np.zeros(n_outputs + n_arms + self._owned_droppers.size)
        _, uplift, tension = np.split(self._shown, [n_outputs, n_outputs + n_arms])
        self._gauges = gauges_of(model)
        self._owned_gauges, watched = _owned_gauges(self._gauges, owned, first)
        others, other_bends, force, by_name = _further_links(interaction.links, watched)
        at_ends = {name: by_name.pop(name) for name in watched}
        self._sources = Sources(pantographs, interaction, scheme, uplift, tension, by_name, at_ends)
        self.layout = RowLayout(self._sources, self._shown)
        self._seen, self._energies_follow_motion = _STATE, energies_follow_motion()
        self._rows_of_unknown: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self._kept_places = np.zeros(0)
        self._row, self._times = np.zeros(self.layout.width), np.zeros(1)
        # The view of all steps, whose step, time and row are set for each.
        self._view = StepView(
            step=0,
            time=0.0,
            row=self._row,
            columns=self.layout.columns,
            node_motion=self._node_motion,
            wire_tension=lambda: self._tension,
            pantograph_places=self._pantograph_places,
            line_state=self._line_state,
            energies=self._energies,
            contact_work=self._contact_work,
            state=self._state,
        )
        links = droppers, others, dropper_bends, other_bends
        window, n_local = self._line.window, self._line.ownership.n_local
        # Values of the line in a row, and the stations with which they change.
        columns = columns_of(
            (self._arm_rows[:, None], droppers.unknowns, others.unknowns),
            n_local,
            None if window is None else window.stations,
        )
        self.shown = native.Shown(self._line.motion.read, self._arm_rows, *links, force, columns)
        stepped = slice(self._line.ownership.first, self._line.ownership.last)
        load = line.load[stepped] if self._unbalanced else np.zeros(0)
        self._energy = LineEnergy(self._line, interaction.links, load, columns)
        self.motion = ShownMotion(self._line, columns, self._energy.pad)
        n = columns.n_stations
        self._show = native.show.bound(self.shown, uplift, tension, 0, n)

    def stage(self, dt: float, start_time: float, n_steps: int) -> Stage:
        """Facts of a run of ``n_steps`` steps of ``dt`` [s] from ``start_time`` [s]."""
        mesh, train = self._model.mesh, self._pantographs
        points = mesh.points.copy()
        points[:, 2] = self._form.height
        if self._form.lateral is not None:
            points[:, 1] = self._form.lateral.y
        return Stage(
            train=TrainLayout(
                train.n_strips,
                train.joints_in_loop,
                train.n_wires,
                self._model.simulated,
                bool(self._gauges.places),
            ),
            dt=dt,
            start_time=start_time,
            n_steps=n_steps,
            arm_x=mesh.x(mesh.steady_arms),
            dropper_x=mesh.x(mesh.droppers[:, 1]),
            owned_arms=self._owned_arms,
            owned_droppers=self._owned_droppers,
            node_points=points,
            owned_nodes=self._owned_nodes,
            unknowns=self._model.unknowns,
            n_places=tuple(places.size for places in train.places()),
            moving=self._moving,
            wire_ends=self._gauges.places,
            owned_ends=self._owned_gauges,
        )

    def view(self, step: int, time: float, *, followed: bool = False) -> StepView:
        """The state after a step; the same object each time.

        ``followed`` says whether a compiled loop has noted which stations moved up to it.
        """
        outputs, row = self._pantographs.outputs, self._row
        self.motion.late(followed=followed)
        if not followed:
            self._moving.all_move()
        self._shown[: outputs.size] = outputs
        self._show()
        row[: self._shown.size] = self._shown
        self.layout.fill(row)
        self._times[0] = time
        self._seen = _STATE
        self._view.move_to(step, self._times, row[np.newaxis])
        return self._view

    def cross(self, time: float, *, found: bool = False) -> None:
        """Find where wires that move sideways cross the strips at ``time`` [s], if any do.

        ``found`` is whether their lateral motion there is already known, as in a restored state.
        Collective.
        """
        if not self._pantographs.lateral:
            return
        self._interaction.locate()
        if not found:
            self._interaction.find_across()
        self._pantographs.cross(time, self._interaction.presence)

    def follow(self, stations: np.ndarray) -> None:
        """Say that only ``stations`` (2,), from and to, have moved since the latest rows."""
        if self._line.window is not None:
            self._moving.follow(self.shown.columns, _OF_COLUMNS, stations)

    def view_of(
        self,
        step: int,
        times: np.ndarray,
        rows: np.ndarray,
        kept: tuple[tuple[tuple[int, int], np.ndarray], np.ndarray] | None = None,
        *,
        broke: bool = False,
    ) -> StepView:
        """View after steps that a compiled loop has taken up to ``step``.

        Parameters
        ----------
        step : int
            Number of the latest step.
        times : ndarray, shape (k,)
            Times of the steps [s].
        rows : ndarray, shape (k, n)
            Rows of the steps; of a long line they are not copied.
        kept : tuple, optional
            Of steps that the loop went on from what is left of their motion, the arguments of
            ``ShownMotion.show``, and places of the pantographs.
        broke : bool
            Whether the loop has left the state amid the next step, so that rows alone are shown.
        """
        self._seen = _ROW if broke else _STATE
        if kept is not None:
            motion, self._kept_places = kept
            self.motion.show(*motion)
            self._seen = _MOTION
        elif not broke:
            self.motion.late(followed=True)
        self._view.move_to(step, times, rows)
        return self._view

    def _node_motion(self, name: str, rate: bool, among: np.ndarray | None = None, /) -> np.ndarray:
        """One unknown of the rank's nodes, or its rate, zero for nodes without it."""
        if name not in self._rows_of_unknown:
            numbering = self._model.numbering
            numbers = numbering.numbers[self._owned_nodes, numbering.names.index(name)]
            there = np.flatnonzero(numbers >= 0)
            self._rows_of_unknown[name] = there, numbers[there] - self._line.ownership.first
        there, own = self._rows_of_unknown[name]
        motion = self._moved.velocity if rate else self._moved.displacement
        if there.size == self._owned_nodes.size:
            return np.take(motion, own if among is None else own[among])
        result = np.zeros(self._owned_nodes.size)
        result[there] = motion[own]
        return result if among is None else result[among]

    def _pantograph_places(self) -> np.ndarray:
        """Heights of the bases, then places of masses and bodies, on rank 0."""
        self._refuse_unseen(_MOTION)
        now = [self._kept_places] if self._seen == _MOTION else self._pantographs.places()
        return np.concatenate([self._pantographs.bases(self._view.time), *now])

    @cached_property
    def _tension(self) -> np.ndarray:
        """Tension of the wires ahead of all nodes, as the line is now [N]."""
        mesh, line = self._model.mesh, self._model.problem.line
        tension = np.zeros(mesh.n_nodes)
        for name, nodes in mesh.wires.items():
            tension[nodes] = line.wire(name).tension_at(mesh.x(nodes))
        # Another temperature adds to that of the installation.
        gained = np.zeros(mesh.n_nodes)
        for name, more in self._form.gained_tension.items():
            first, second = mesh.elements(name).T
            gained[second] = more
            gained[first] = more
        return tension + gained

    def _line_state(self) -> Mapping[str, np.ndarray]:
        self._refuse_unseen(_STATE)
        return self._line.state()

    @property
    def _moved(self) -> ShownMotion:
        """The motion at the step that is shown."""
        self._refuse_unseen(_MOTION)
        return self.motion

    def _refuse_unseen(self, wanted: int) -> None:
        if wanted > self._seen:
            kept = "row" if self._seen == _ROW else "motion"
            raise RuntimeError(f"of this step only the {kept} was kept, see `Observer`")

    def _energies(self) -> tuple[float, ...]:
        """The energies that are recorded, in the order of their table. Collective."""
        if not self._energies_follow_motion:
            self._shown[:] = self._view.row[: self._shown.size]
        return energies_of(Energies(*self._line_energies(), self._sources))

    def _contact_work(self) -> float:
        self._refuse_unseen(_STATE)
        return float(self._pantographs.work.total[0])

    def _line_energies(self) -> tuple[float, float]:
        """Kinetic and elastic energy relative to the first rest, slack droppers as they are [J].

        Collective. After an incident it is that of what is left of the line; see `after_incidents`.
        """
        contacts = self._view.row[self.layout.columns["contact_position"]]
        parts = self._energy.parts(self._moved, contacts)
        kinetic, elastic = total(self._comm, parts).tolist()
        return kinetic, elastic + self._changed.energy if self._unbalanced else elastic

    def _state(self) -> State | None:
        """State to continue from after the step shown last, on rank 0. Collective."""
        self._refuse_unseen(_STATE)
        return self.checkpoints.make(self._view.step)


def _owned_gauges(
    gauges: Gauges, owned: Callable[[np.ndarray], np.ndarray], first: int
) -> tuple[np.ndarray, dict[str, native.Links]]:
    """Numbers of the gauges that a rank owns, and what they watch in its unknowns."""
    if not gauges.places:
        return np.zeros(0, dtype=np.int64), {}
    mine = np.flatnonzero(owned(gauges.watched[GAUGES[0]].unknowns[:, 0]))
    local = {
        name: some_of(links._replace(unknowns=links.unknowns - first), mine)
        for name, links in gauges.watched.items()
    }
    return mine, local


def _further_links(
    links: FollowedLinks, watched: Mapping[str, native.Links]
) -> tuple[native.Links, native.Dependents, np.ndarray, dict[str, np.ndarray]]:
    """Owned links of one sign other than droppers, followed by gauges.

    Returns them, their bends, an array for their forces [N], and views of that array by the names
    of components and of quantities of gauges.
    """
    shown = {name: links.shown(name)[1:] for name in links.table.components if name != DROPPERS}
    parts = {name: own for name, (own, _) in shown.items()} | dict(watched)
    if not parts:
        return NO_LINKS, native.Dependents(NO_LINKS, np.zeros(1, dtype=np.int64)), np.zeros(0), {}
    counts = [np.diff(bends.begin) for _, bends in shown.values()]
    counts += [np.zeros(part.law.size, dtype=np.int64) for part in watched.values()]
    added = [bends.links for _, bends in shown.values()] or [NO_LINKS]
    bends = native.Dependents(_one_after_another(added), np.cumsum(np.concatenate([[0], *counts])))
    width = max(part.unknowns.shape[1] for part in parts.values())
    wide = [padded(part, width) for part in parts.values()]
    ends = np.cumsum([part.law.size for part in wide])
    force = np.zeros(ends[-1])
    by_name = dict(zip(parts, np.split(force, ends[:-1]), strict=True))
    return _one_after_another(wide), bends, force, by_name


def _one_after_another(parts: list[native.Links]) -> native.Links:
    return native.Links(*map(np.concatenate, zip(*parts, strict=True)))
