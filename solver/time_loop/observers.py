"""What the time loop shows to those who watch it. Observers never change a run and never solve."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

# What the pantographs tell comes first, in the order in which they keep it.
_IN_A_ROW = (
    "contact_position",
    "contact_force",
    "head_height",
    "wire_height",
    "strip_force",
    "constraint_violation",
    "arm_uplift",
    "dropper_force",
)


@dataclass(frozen=True)
class Stage:
    """What is fixed before the first step. All ranks hold the global arrays.

    Attributes
    ----------
    n_pantographs : number of pantographs
    n_strips : of each pantograph in running order
    joints_in_loop : whether a pantograph has joints that may open, all its bodies being moved
    dt, start_time : time step and time of the initial state [s]
    n_steps : steps planned
    arm_x, dropper_x : positions of steady arms and droppers [m]
    owned_arms, owned_droppers : indices of those whose values this rank provides; every index has
        exactly one owner
    node_points : (n_nodes, 3) static equilibrium shape of the line [m], z up
    owned_nodes : node numbers of the rows of ``Snapshot.uplift``, one owner each
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
    joints_in_loop: bool = False

    @property
    def several_strips(self) -> bool:
        """Whether any pantograph has more than one strip, so that their shares are of interest."""
        return max(self.n_strips, default=1) > 1


@dataclass
class StepView:
    """The state after a step; arrays are views that the next step overwrites.

    The arrays it is made of are copied into one, ``row``, whose parts they are from then on, so
    that keeping all of a step is a single copy.

    Attributes
    ----------
    step, time : number of the step (0 is the initial state) and its time [s]
    contact_position : (n_pantographs,) along the track [m], all ranks
    contact_force, head_height, wire_height : (n_pantographs,) [N], [m], [m], rank 0 only
    dropper_force : (n owned droppers,) tension, negative in compression [N]; of the spring alone
        where the dampers of slack droppers are kept in action
    arm_uplift : (n owned arms,) vertical displacement of the contact wire from equilibrium [m]
    node_uplift : () -> (n owned nodes,) vertical displacement [m]; not collective
    energies : () -> (kinetic, elastic) of the line relative to equilibrium [J]; collective
    checkpoint : () -> dict of arrays on rank 0 with which to continue, None elsewhere; collective
    strip_force : (number of all strips,) share of each strip in the contact force, pantograph by
        pantograph, the leading strip first [N], rank 0 only
    constraint_violation : (n_pantographs,) largest open joint [m], NaN for those without joints in
        the time loop, rank 0 only
    row : all these arrays one after another
    columns : where in the row each is, by name
    """

    step: int
    time: float
    contact_position: np.ndarray
    contact_force: np.ndarray
    head_height: np.ndarray
    wire_height: np.ndarray
    dropper_force: np.ndarray
    arm_uplift: np.ndarray
    node_uplift: Callable[[], np.ndarray]
    energies: Callable[[], tuple[float, float]]
    checkpoint: Callable[[], dict[str, Any] | None]
    strip_force: np.ndarray = field(default_factory=lambda: np.zeros(0))
    constraint_violation: np.ndarray = field(default_factory=lambda: np.zeros(0))
    row: np.ndarray = field(init=False)
    columns: dict[str, slice] = field(init=False)

    def __post_init__(self) -> None:
        arrays = [getattr(self, name) for name in _IN_A_ROW]
        self.row = np.concatenate(arrays)
        ends = np.cumsum([0, *(array.size for array in arrays)]).tolist()
        self.columns = {
            name: slice(*part)
            for name, part in zip(_IN_A_ROW, itertools.pairwise(ends), strict=True)
        }
        for name, part in self.columns.items():
            setattr(self, name, self.row[part])


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
class BlockObserver(Observer, Protocol):
    """An observer to whom the rows of many steps may be shown at once, which costs little a step.

    Steps are shown to it in order: by ``observe_rows``, or by ``observe``.
    """

    def next_state(self, step: int) -> int:
        """The next step after ``step`` that ``observe`` has to show, as it needs more than the row.

        Asked when all steps up to ``step`` are shown.
        """

    def observe_rows(self, first_step: int, times: np.ndarray, rows: np.ndarray) -> None:
        """After steps before the next state, of which only the rows are left. Not collective.

        Parameters
        ----------
        first_step : number of the step of the first row
        times : (k,) [s]
        rows : (k, n), ``StepView.row`` of each; overwritten by what is shown next
        """
