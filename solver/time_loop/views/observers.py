"""What the time loop shows to those who watch it. Observers never change a run and never solve."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from catenary.solver.model.gauges import GaugePlace
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import Train
from catenary.solver.window.moving_columns import MovingColumns


@dataclass(frozen=True)
class Stage:
    """What is fixed before the first step. All ranks hold the global arrays.

    Attributes
    ----------
    n_pantographs : number of pantographs
    n_strips : of each pantograph in running order
    joints_in_loop : whether a pantograph has joints that may open, all its bodies being moved
    n_wires : number of contact wires
    lateral, uplift_stops : whether wires move sideways, and whether steady arms have stops
    dt, start_time : time step and time of the initial state [s]
    n_steps : steps planned
    arm_x, dropper_x : positions of steady arms and droppers [m]
    owned_arms, owned_droppers : indices of those whose values this rank provides; every index has
        exactly one owner
    node_points : (n_nodes, 3) static equilibrium shape of the line [m], z up
    owned_nodes : node numbers of what ``StepView.node_motion`` returns, one owner each
    unknowns : names of the unknowns that nodes have
    moving : which columns of arms and droppers have changed since the rows that were shown before
    wire_ends : places of gauges at wire ends and mid-points, none without motion along the track
    owned_ends : indices of those whose values this rank provides
    n_places : how many numbers say where each pantograph's masses or bodies are; on rank 0
    """

    n_pantographs: int
    dt: float
    start_time: float
    n_steps: int
    arm_x: np.ndarray
    dropper_x: np.ndarray
    owned_arms: np.ndarray
    owned_droppers: np.ndarray
    node_points: np.ndarray
    owned_nodes: np.ndarray
    n_strips: tuple[int, ...] = ()
    unknowns: tuple[str, ...] = ("w", "theta_y")
    n_places: tuple[int, ...] = ()
    joints_in_loop: bool = False
    n_wires: int = 1
    lateral: bool = False
    uplift_stops: bool = False
    moving: MovingColumns = field(default_factory=MovingColumns)
    wire_ends: tuple[GaugePlace, ...] = ()
    owned_ends: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def places(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Positions of what columns of the line's channels stand for, by its kind, and those that
        this rank owns."""
        return {
            channels.ARM: (self.arm_x, self.owned_arms),
            channels.DROPPER: (self.dropper_x, self.owned_droppers),
            channels.WIRE_END: (np.array([end.x for end in self.wire_ends]), self.owned_ends),
        }

    @property
    def train(self) -> Train:
        """What decides which channels are recorded."""
        strips = self.n_strips or (1,) * self.n_pantographs
        laws = self.lateral, self.uplift_stops, bool(self.wire_ends)
        return Train(strips, self.joints_in_loop, self.n_wires, *laws)


@dataclass
class StepView:
    """The state after a step; arrays are views that the next step overwrites.

    A channel's values are an attribute of its name: those of arms and droppers are the rank's own,
    those of pantographs and strips rank 0 has, ``contact_position`` all ranks.

    Attributes
    ----------
    step, time : number of the step (0 is the initial state) and its time [s]
    row : (n,) the values of all channels one after another
    columns : where in the row each channel is, by name
    node_uplift : () -> (n owned nodes,) vertical displacement [m]; not collective
    node_motion : (name of an unknown, whether its rate is meant, which of the owned nodes, all if
        that is left out) -> (n nodes,) [m], [m/s] or
        [-], [1/s], zero for nodes without it; not collective
    wire_tension : () -> (n_nodes,) tension of the wires ahead of all nodes [N], the same array as
        long as it does not change; not collective
    pantograph_places : () -> heights of the pantographs' bases, then where masses and bodies of
        each are, see `mbs.interface`, one array on rank 0, empty elsewhere; not collective
    line_state : () -> displacement, velocity and acceleration of the rank's unknowns, by these
        names; not collective
    energies : () -> the values of ``channels.ENERGIES`` but the time, kinetic and elastic energy of
        the line relative to equilibrium first [J]; collective
    contact_work : () -> work of the contact forces on this rank's part of the line since the march
        was made [J]; not collective
    state : () -> arrays by name on rank 0 with which to continue, None elsewhere, each of which is
        made when it is read, before the next step; collective
    """

    step: int
    time: float
    row: np.ndarray
    columns: dict[str, slice]
    node_uplift: Callable[[], np.ndarray]
    node_motion: NodeMotion
    wire_tension: Callable[[], np.ndarray]
    pantograph_places: Callable[[], np.ndarray]
    line_state: Callable[[], Mapping[str, np.ndarray]]
    energies: Callable[[], tuple[float, ...]]
    state: Callable[[], Mapping[str, Any] | None]
    contact_work: Callable[[], float] = lambda: 0.0

    def checkpoint(self) -> dict[str, Any] | None:
        """The same, to be kept. Collective."""
        state = self.state()
        return None if state is None else dict(state)

    def __getattr__(self, name: str) -> np.ndarray:
        """The values of a channel."""
        columns = self.__dict__.get("columns", {})
        if name not in columns:
            raise AttributeError(f"a step shows no {name}")
        part: np.ndarray = self.row[columns[name]]
        return part


def row_of(values: Mapping[str, np.ndarray]) -> tuple[np.ndarray, dict[str, slice]]:
    """A row of these values by channel, and where in it each channel is."""
    ends = np.cumsum([0, *(array.size for array in values.values())]).tolist()
    columns = {
        name: slice(*part) for name, part in zip(values, itertools.pairwise(ends), strict=True)
    }
    return np.concatenate([np.zeros(0), *values.values()]), columns


class NodeMotion(Protocol):
    """One unknown of a rank's nodes, or its rate. Not collective."""

    def __call__(self, name: str, rate: bool, among: np.ndarray | None = None, /) -> np.ndarray:
        """The values of those owned nodes whose numbers among them are given, of all if not."""


class Observer(Protocol):
    """Watches a run. All methods are called on all ranks at the same steps."""

    def start(self, stage: Stage) -> None:
        """Before the initial state is shown."""

    def observe(self, view: StepView) -> None:
        """After the initial state and after every step. May be collective at steps that depend
        only on ``view.step``."""

    def finish(self, outcome: str) -> None:
        """After the last step: "done", "interrupted" or the sentence of what broke."""


@runtime_checkable
class MotionObserver(Observer, Protocol):
    """A `BlockObserver` that at some steps needs the motion of nodes or ``energies`` and no more.

    The places of pantographs are kept as well.

    A block goes on behind them: these steps are shown by ``observe_motion`` when the rows of the
    block are shown. Where a block ends at such a step, there is ``observe`` alone.
    """

    def next_motion(self, step: int) -> int:
        """The next step after ``step`` of which that is needed; asked for any step."""

    def observe_motion(self, view: StepView) -> None:
        """After a step whose motion was kept, for this observer or another one. Not collective.

        What else a view has, the row excepted, is refused.
        """


@runtime_checkable
class BlockObserver(Observer, Protocol):
    """An observer to whom the rows of many steps may be shown at once, which costs little a step.

    Each step is shown to it once, in order: by ``observe_rows``, or by ``observe``.
    """

    def next_state(self, step: int) -> int:
        """The next step after ``step`` that ``observe`` has to show, as it needs more than the row.

        Called when all steps up to ``step`` are shown.
        """

    def observe_rows(self, first_step: int, times: np.ndarray, rows: np.ndarray) -> None:
        """After steps before the next state, of which only the rows are left. Not collective.

        Parameters
        ----------
        first_step : number of the step of the first row
        times : (k,) [s]
        rows : (k, n), ``StepView.row`` of each; overwritten by what is shown next
        """
