"""From a scene's ``[output]`` to what is recorded and how often: the same in plan and run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from catenary.mbs.build import has_joints
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role
from catenary.postproc.files.header import GZIP, NONE, LineRecord, record_words
from catenary.postproc.record.snapshots.contents import (
    USUAL_FIELDS,
    Course,
    FieldRecord,
)
from catenary.solver.effects.all_effects import simulated
from catenary.solver.effects.shipped.motion_effects import moves_along
from catenary.solver.model.gauges import gauge_places
from catenary.solver.problem.problem import Problem
from catenary.solver.time_loop.views import channels
from catenary.solver.window.choice import Reach, reach_of_motion

if TYPE_CHECKING:
    from catenary.cases.scene.run.case import OutputTable

# Size up to which the line's channels are recorded at every step, and snapshots at their usual
# cadence, unless the scene says otherwise [B].
WHOLE_UP_TO = 500e6
# Record of the line's channels beyond it: every so often [s], so far behind and ahead of
# the train [m].
THINNED_EVERY, THINNED_WINDOW = 5e-3, (300.0, 200.0)
FIELD_EVERY = 0.05  # [s]
# Times at which the part of the line in a window is counted.
_SAMPLES = 200


class Extent(NamedTuple):
    """Recorded parts of a line: positions of arms and droppers [m], nodes and cells of snapshots.

    ``n_cells`` are the elements of the wires and the droppers.
    """

    arm_x: np.ndarray
    dropper_x: np.ndarray
    n_nodes: int
    n_cells: int


def extent_of(mesh: LineMesh) -> Extent:
    """Recorded parts of a mesh. Not collective."""
    n_cells = sum(len(mesh.elements(name)) for name in mesh.wires) + len(mesh.droppers)
    arms, droppers = mesh.x(mesh.steady_arms), mesh.x(mesh.droppers[:, 1])
    return Extent(arms, droppers, mesh.n_nodes, n_cells)


def extent_before_meshing(line: Line, n_nodes: int) -> Extent:
    """Recorded parts of a line before it is meshed, with the number of its nodes alone."""
    arm_x = np.sort(np.concatenate([[], *(group.x for group in line.steady_arms)]))
    n_pieces = sum(len(wire.pieces) for wire in line.wires)
    n_cells = n_nodes - n_pieces + line.dropper_x.size
    return Extent(arm_x, line.dropper_x, n_nodes, n_cells)


@dataclass(frozen=True)
class Recording:
    """Records of a run.

    Attributes
    ----------
    line : of the line's channels
    fields : of the snapshots
    field_every, energy_every : steps between two records, None for none
    field_by_size : whether snapshots are rarer because of their size
    extent : recorded parts of the line
    n_steps : steps after step 0
    end_x : positions of ends of wires and sides of mid-points that are recorded [m]
    """

    line: LineRecord
    fields: FieldRecord
    field_every: int | None
    energy_every: int | None
    field_by_size: bool
    extent: Extent
    n_steps: int
    end_x: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def sentences(self, dt: float) -> dict[str, str]:
        """Records in words, by their kind, at a time step of ``dt`` [s]."""
        ends = ", tensions and travel at wire ends" if self.end_x.size else ""
        what = f"arm uplift and dropper forces{ends}"
        texts = {"line": f"{what} {record_words(self.line, dt)}"}
        if self.field_every:
            chosen = " (chosen by size)" if self.field_by_size else ""
            texts["film"] = f"a snapshot of the line every {self.field_every * dt:.3g} s{chosen}"
            if self.fields.fields != USUAL_FIELDS:
                texts["film"] += f" with {', '.join(self.fields.fields)}"
            if self.fields.wave_speed:
                texts["film"] += f" as far as waves of {self.fields.wave_speed:.3g} m/s have come"
            elif self.fields.window is not None:
                behind, ahead = self.fields.window
                texts["film"] += f" from {behind:g} m behind to {ahead:g} m ahead of the train"
            if self.fields.rests_beyond:
                texts["film"] += "; the line beyond is at rest"
        return texts

    def thinned(self, dt: float) -> list[str]:
        """The sentences of what its size has thinned, for the log."""
        chosen = {"line": self.line.by_size, "film": self.field_by_size}
        return [text for name, text in self.sentences(dt).items() if chosen[name]]


def recording_of(
    output: OutputTable,
    problem: Problem,
    extent: Extent,
    n_steps: int,
    usual_s: float = FIELD_EVERY,
    with_train: bool = True,
) -> Recording:
    """Records of a run of a problem. Not collective.

    Parameters
    ----------
    output : the scene's table
    n_steps : steps after step 0
    usual_s : from one snapshot to the next where neither the table nor their size decides [s]
    with_train : whether the train alone sets the line into motion, and a window follows it
    """
    reach = reach_of_motion(problem) if with_train else None
    fields = _field_record(output, problem, reach)
    field_every, by_size = _field_every(output, problem, fields, extent, n_steps, usual_s)
    train = train_of(problem)
    end_x = np.array([end.x for end in gauge_places(problem, train.moves_along)])
    places = {
        channels.ARM: extent.arm_x.size,
        channels.DROPPER: extent.dropper_x.size,
        channels.WIRE_END: end_x.size,
    }
    names = channels.line_channels(train)
    n_columns = sum(places[channels.CHANNELS[name].per] for name in names)
    return Recording(
        _line_record(output, problem, n_columns, n_steps, reach).of(train),
        fields,
        field_every,
        cadence(output.energy_every_s, problem.numerics.dt),
        by_size,
        extent,
        n_steps,
        end_x,
    )


def train_of(problem: Problem) -> channels.TrainLayout:
    """The facts of a problem that decide which channels a run has. Not collective."""
    places = problem.train.placements
    return channels.TrainLayout(
        tuple(len(place.data.strips.offsets) for place in places),
        any(has_joints(place.data) for place in places),
        len(problem.line.wires_of(Role.CONTACT)),
        simulated(problem),
        moves_along(problem),
    )


def cadence(every: float, dt: float) -> int | None:
    """Steps between two records that are to be ``every`` [s] apart; None for none."""
    return max(1, round(every / dt)) if every > 0 else None


def _line_record(
    output: OutputTable, problem: Problem, n_columns: int, n_steps: int, reach: Reach | None
) -> LineRecord:
    dt, given = problem.numerics.dt, output.chooses_line_channels
    if not given and 8.0 * n_columns * (n_steps + 1) > WHOLE_UP_TO:
        return LineRecord(
            every=cadence(THINNED_EVERY, dt) or 1,
            window=THINNED_WINDOW,
            compression=output.line_channels_compression or GZIP,
            by_size=True,
        )
    every_s = output.line_channels_every_s or 0.0
    if output.line_channels_every_m is not None:
        every_s = output.line_channels_every_m / problem.train.speed
    window, spans = output.line_channels_window_m, output.line_channels_spans
    if not given and reach is not None and not reach.wave_speed:
        window = [reach.behind, reach.ahead]
    masts = problem.line.support_positions
    names = output.line_channels
    return LineRecord(
        every=cadence(every_s, dt) or 1,
        window=None if window is None else (window[0], window[1]),
        stretch=None if spans is None else (float(masts[spans[0] - 1]), float(masts[spans[1]])),
        names=tuple(n for n in channels.line_channels() if names is None or n in names),
        compression=output.line_channels_compression or NONE,
    )


def _field_every(
    output: OutputTable,
    problem: Problem,
    fields: FieldRecord,
    extent: Extent,
    n_steps: int,
    usual_s: float,
) -> tuple[int | None, bool]:
    """Steps between two snapshots, None for none, and whether their size has made them rarer."""
    dt = problem.numerics.dt
    if output.field_every_m is not None:
        return cadence(output.field_every_m / problem.train.speed, dt), False
    if output.field_every_s is not None:
        return cadence(output.field_every_s, dt), False
    usual = cadence(usual_s, dt) or 1
    share = shown_share(fields, problem, n_steps)
    most = max(1.0, WHOLE_UP_TO / (share * snapshot_bytes(fields, extent)))
    needed = int(np.ceil(n_steps / most))
    return max(usual, needed), needed > usual


def _field_record(output: OutputTable, problem: Problem, reach: Reach | None) -> FieldRecord:
    """Recorded part of the fields: the moving one, unless the scene says how far."""
    masts, train = problem.line.support_positions, problem.train
    spans, window = output.field_spans, output.field_window_m
    follows = spans is None and window is None and reach is not None
    if follows and reach is not None:
        window = [reach.behind, reach.ahead]
    behind = [placement.behind for placement in train.placements]
    return FieldRecord(
        fields=USUAL_FIELDS if output.fields is None else tuple(output.fields),
        parts=None if output.field_parts is None else tuple(output.field_parts),
        stretch=None if spans is None else (float(masts[spans[0] - 1]), float(masts[spans[1]])),
        window=None if window is None else (window[0], window[1]),
        course=Course(train.start - max(behind), train.start - min(behind), train.speed),
        wave_speed=reach.wave_speed if follows and reach is not None else 0.0,
        rests_beyond=follows,
    )


def snapshot_bytes(fields: FieldRecord, extent: Extent) -> float:
    """Bytes of the values of a snapshot of the whole line, whatever its parts."""
    n_droppers, n_arms = extent.dropper_x.size, extent.arm_x.size
    total = 0.0
    for kind in fields.kinds:
        n_values = extent.n_nodes
        if kind.of_droppers:
            n_values = n_droppers
        elif not kind.of_wires:
            n_values += 2 * n_droppers + n_arms * 2
        total += kind.item_bytes * n_values
    return total


def shown_share(fields: FieldRecord, problem: Problem, n_steps: int) -> float:
    """Share of the line's length that snapshots show, mean over a run of ``n_steps`` [-]."""
    begin, end = problem.line.support_positions[[0, -1]]
    low, high = fields.edges(np.linspace(0.0, n_steps * problem.numerics.dt, _SAMPLES))
    first, last = (begin, end) if fields.stretch is None else fields.stretch
    shown = np.clip(np.minimum(high, last) - np.maximum(low, first), 0.0, None)
    return max(float(shown.mean() / (end - begin)), 1e-6)
