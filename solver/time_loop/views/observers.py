"""Views of a run for observers, which never change a run and never solve."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from catenary.solver.model.gauges import GaugePlace
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import TrainLayout
from catenary.solver.window.moving_columns import MovingColumns


@dataclass(frozen=True)
class Stage:
    """Facts of a run that are fixed before the first step. All ranks hold the global arrays.

    Attributes
    ----------
    train : properties that determine which channels are recorded
    dt, start_time : time step and time of the initial state [s]
    n_steps : number of planned steps
    arm_x, dropper_x : (n_arms,), (n_droppers,) positions of steady arms and droppers [m]
    owned_arms, owned_droppers : indices of the arms and droppers whose values this rank provides;
        every index has exactly one owner
    node_points : (n_nodes, 3) static equilibrium shape of the line [m], z up
    owned_nodes : numbers of the nodes in ``StepView.node_motion``; every node has one owner
    unknowns : names of the unknowns of nodes
    moving : columns of arms and droppers that have changed since the previous rows
    wire_ends : places of gauges at wire ends and mid-points, none without motion along the track
    owned_ends : indices of the gauges whose values this rank provides
    n_places : number of places of masses or bodies of each pantograph; on rank 0
    """

    train: TrainLayout
    dt: float
    start_time: float
    n_steps: int
    arm_x: np.ndarray
    dropper_x: np.ndarray
    owned_arms: np.ndarray
    owned_droppers: np.ndarray
    node_points: np.ndarray
    owned_nodes: np.ndarray
    unknowns: tuple[str, ...] = ("w", "theta_y")
    n_places: tuple[int, ...] = ()
    moving: MovingColumns = field(default_factory=MovingColumns)
    wire_ends: tuple[GaugePlace, ...] = ()
    owned_ends: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def places(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Positions [m] and owned indices of the columns of the line's channels, by their subject:
        arm, dropper or wire end."""
        return {
            channels.ARM: (self.arm_x, self.owned_arms),
            channels.DROPPER: (self.dropper_x, self.owned_droppers),
            channels.WIRE_END: (np.array([end.x for end in self.wire_ends]), self.owned_ends),
        }

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs."""
        return len(self.train.n_strips)


@dataclass
class StepView:
    """Steps that were taken since the view before, and the state after the last of them.

    Arrays are views that the next steps overwrite. A channel's values after the last step are an
    attribute of its name: those of arms and droppers are the rank's own, those of pantographs and
    strips rank 0 has, ``contact_position`` all ranks.

    Attributes
    ----------
    step, time : number of the last step (0 is the initial state) and its time [s]
    row : (n,) the values of all channels after it, one after another
    columns : slice of a row for each channel, by name
    times, rows : (k,) times [s] and (k, n) rows of all steps of the view; those of the last step
        alone if not given
    node_motion : (name of an unknown, whether its rate, indices of owned nodes or all) ->
        (n nodes,) [m], [m/s] or [-], [1/s], zero for nodes without it; not collective
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

    A view refuses parts of the last step that no observer requested; its row is always there.
    """

    step: int
    time: float
    row: np.ndarray
    columns: dict[str, slice]
    node_motion: NodeMotion
    wire_tension: Callable[[], np.ndarray]
    pantograph_places: Callable[[], np.ndarray]
    line_state: Callable[[], Mapping[str, np.ndarray]]
    energies: Callable[[], tuple[float, ...]]
    state: Callable[[], Mapping[str, Any] | None]
    contact_work: Callable[[], float] = lambda: 0.0
    times: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rows: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        if not self.times.size:
            self.move_to(self.step, np.array([self.time]), self.row[np.newaxis])

    @property
    def first_step(self) -> int:
        """Number of the first of the steps."""
        return self.step + 1 - len(self.times)

    def move_to(self, step: int, times: np.ndarray, rows: np.ndarray) -> None:
        """Show steps up to ``step``, with their times (k,) [s] and rows (k, n)."""
        self.step, self.times, self.rows = step, times, rows
        self.time, self.row = float(times[-1]), rows[-1]

    def each(self, channel: str) -> np.ndarray:
        """Values of a channel after each of the steps, shape (k, columns)."""
        return self.rows[:, self.columns[channel]]

    def checkpoint(self) -> dict[str, Any] | None:
        """A copy of ``state`` that stays valid after the next step. Collective."""
        state = self.state()
        return None if state is None else dict(state)

    def __getattr__(self, name: str) -> np.ndarray:
        """The values of a channel."""
        columns = self.__dict__.get("columns", {})
        if name not in columns:
            raise AttributeError(f"a step shows no {name}")
        part: np.ndarray = self.row[columns[name]]
        return part


class NodeMotion(Protocol):
    """One unknown of a rank's nodes, or its rate. Not collective."""

    def __call__(self, name: str, rate: bool, among: np.ndarray | None = None, /) -> np.ndarray:
        """Values (n,) of the unknown ``name``, or of its rate, at owned nodes.

        ``among`` (n,) are indices among the owned nodes, all of them if not given.
        """


# A step that never comes.
NEVER = 2**62


class Observer(ABC):
    """Watches a run. All methods are called on all ranks at the same steps.

    Each step is shown once, in order, the initial state first, many steps in one view. Every step
    shows its row; those that ``next_state`` returns show the whole state, those of ``next_motion``
    the motion.
    """

    def start(self, stage: Stage) -> None:  # noqa: B027  (many need nothing)
        """Before the initial state is shown."""

    @abstractmethod
    def next_state(self, step: int) -> int:
        """The next step after ``step`` whose state is to be shown, ``NEVER`` if rows suffice.

        Called when all steps up to ``step`` are shown. A run that shows the state of every step
        takes many times as long.
        """

    def next_motion(self, step: int) -> int:
        """The next step after ``step`` whose motion is to be shown, ``NEVER`` if none.

        The motion is that of nodes, the places of pantographs and ``energies``. It is kept while
        compiled steps go on, so that it costs less than a state. Called for any ``step``.
        """
        return NEVER

    @abstractmethod
    def observe(self, view: StepView) -> None:
        """Process the steps of ``view``, the last of which may be a requested one.

        It may be collective at steps that follow from ``view.step`` and ``next_state`` alone.
        """

    def finish(self, outcome: str) -> None:  # noqa: B027  (many need nothing)
        """After the last step: "done", "interrupted" or the sentence of what broke."""
