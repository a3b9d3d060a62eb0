"""Both sides of the small problem of a step as functions of the contact forces: line and pan heads.

What a rank sends of the line's side travels in two arrays of numbers; Python takes named views of
them. All strips of a train stand in one state of heads at the end of a step.
"""

from __future__ import annotations

import numpy as np

from catenary.mbs.interface import HeadState, affine
from catenary.solver.kernels.native import FLAGS, Bounds, LinkRows, Share

# Numbers that add up over ranks besides answers.
N_FLAGS = FLAGS.itemsize // 8


class LineResponse:
    """Answers of the line to n contacts, and a row for each link that may switch.

    Attributes
    ----------
    summed : everything that adds up over ranks, in one array
    line : Affine, free heights [m] and total rates [m/s] of the wire at the contacts; its views
    present : (n,) 1 for contacts whose wire is on the strip, else 0; the same on all ranks
    early_height, early_rate : (n,) wire heights [m] and rates [m/s] extrapolated from the line's
        motion; (0,) without ``early``
    rows : ``native.LinkRows``, whose ``numbers`` (capacity, 2 + 3 n) are sent
    share : Share, all this as kernels take it
    bounds : Bounds; kept by reference

    Parameters
    ----------
    n_contacts, capacity : number of contacts, and of links that have room
    early : whether there is room for extrapolated heights and rates
    bounds : unlimited if not given
    """

    def __init__(
        self,
        n_contacts: int,
        capacity: int,
        early: bool = False,
        bounds: Bounds | None = None,
    ) -> None:
        n, n_early = n_contacts, n_contacts if early else 0
        self.n_contacts, self.capacity = n, capacity
        sizes = (N_FLAGS, 2 * n * (1 + n), n_early, n_early)
        self.summed = np.zeros(sum(sizes))
        flags, answers, self.early_height, self.early_rate = np.split(
            self.summed, np.cumsum(sizes)[:-1]
        )
        self.line = affine(answers, n)
        self.rows = LinkRows(np.zeros((capacity, 2 + 3 * n)))
        self.present = np.ones(n)
        self.bounds = bounds or Bounds(*(np.full(size, np.inf) for size in (n, n, 1)))
        self.share = Share(flags.view(FLAGS), self.present, self.line, self.rows, self.bounds)

    @property
    def count(self) -> int:
        """Number of links that may switch and have a row."""
        return int(self.summed[0])

    @count.setter
    def count(self, count: int) -> None:
        self.summed[0] = count

    @property
    def flags(self) -> tuple[float, float, float, float]:
        """Number of links with a row, and over all ranks: whether one ends the march with this
        step, whether one holds NaN or infinity, and the number of links without room."""
        count, stop, broken, missing = self.summed[:N_FLAGS].tolist()
        return count, stop, broken, missing

    def put_stop(self, stop: bool) -> None:
        """Set whether this rank ends the march with this step."""
        self.summed[1] = stop

    @property
    def links(self) -> np.ndarray:
        """Numbers of the links with a row (m,)."""
        return self.rows.numbers[: self.count, 0].astype(np.int64)


class Heads(HeadState):
    """Heads over all n contacts of a train; pantographs fill their parts of it.

    The compliances are zero between strips of different pantographs. ``early_height`` and
    ``early_velocity`` (n,) hold what an extrapolation of the motion says, if a coupling asks for
    it.
    """

    def __init__(self, n: int) -> None:
        super().__init__(n)
        self.early_height = np.zeros(n)
        self.early_velocity = np.zeros(n)

    def put(self, strips: slice, head: HeadState) -> None:
        """Copy the state of one pantograph's head to its ``strips``."""
        self.height[strips] = head.height
        self.velocity[strips] = head.velocity
        self.height_compliance[strips, strips] = head.height_compliance
        self.velocity_compliance[strips, strips] = head.velocity_compliance
