"""Steps in the compiled loop with derivatives by parameters beside them.

A tangent is a motion of the same line by the same factors, with arrays of its own; see
`kernels/tangents/tangents.hpp` for its equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import RunBroken
from catenary.mbs.head.head_arrays import LinearStep
from catenary.mbs.head.newmark_head import SteppedHead
from catenary.solver.integrators.line_integrator import FurtherMotion
from catenary.solver.kernels import native
from catenary.solver.model.switching_links import LinkArrays
from catenary.solver.schemes.one_solve import OneSolve
from catenary.solver.tangents.set_up import Change, MatrixTerm
from catenary.solver.time_loop.compiled_steps import Block, CompiledSteps, StepParts
from catenary.solver.time_loop.prepared_line import make_room
from catenary.solver.time_loop.views.step_views import Showing


class LinkChange(NamedTuple):
    """Derivatives of links; see `kernels/tangents/tangents.hpp`, as for the next four."""

    law: np.ndarray
    weights: np.ndarray


class HeadChange(NamedTuple):
    """Derivatives of a head; ``state`` goes on with the steps."""

    matrix: np.ndarray
    by_drive: np.ndarray
    by_head: np.ndarray
    inverse: np.ndarray
    state: np.ndarray
    beside: Sequence[native.Head]
    step: float


class LawChange(NamedTuple):
    """Derivatives of the contact law; ``speed`` and ``latest`` go on with the steps."""

    tangents: np.ndarray
    hertz: np.ndarray
    speed: np.ndarray
    latest: np.ndarray


class Tangent(NamedTuple):
    """A march differentiated by one parameter."""

    free: native.TwoPasses
    loads: np.ndarray
    matrices: Sequence[MatrixTerm]
    rest: np.ndarray
    links: LinkChange
    heads: Sequence[HeadChange]
    drives: np.ndarray
    law: LawChange
    start: np.ndarray
    speed: float
    results: np.ndarray


class MarchTangents(NamedTuple):
    """All tangents of a march; ``switches`` (3,) counts steps in which a contact was open, in which
    contacts opened or closed, and in which links switched."""

    all: Sequence[Tangent]
    pairs: Sequence[Sequence[native.Head]]
    links: LinkArrays
    first: np.ndarray
    switches: np.ndarray


class TangentSteps(CompiledSteps):
    """Takes steps of a scheme, and their derivatives. One rank only.

    Attributes
    ----------
    results : (most, n_changes, 2 n_pantographs + n_arms) derivatives after the steps of the latest
        block of contact forces [N], uplifts [m] and heights of heads [m], per unit of each
        parameter
    switches : as in ``MarchTangents``

    Parameters
    ----------
    changes : of the set-up by each parameter
    others : heads of two further set-ups of the same march
    starts : derivatives of the line's acceleration at the start, (n_local,) each [m/s2 per unit]
    """

    def __init__(
        self,
        scheme: OneSolve,
        showing: Showing,
        dt: float,
        changes: Sequence[Change],
        others: Sequence[Sequence[LinearStep | SteppedHead]],
        starts: Sequence[np.ndarray],
    ) -> None:
        super().__init__(scheme, showing, dt, shows=True)
        make_room(scheme)
        line, pantographs = scheme.interaction.line, scheme.pantographs
        n_results = 2 * pantographs.n + showing.shown.arms.size
        self._by_tangent = np.zeros((len(changes), self.most, n_results))
        n, first = pantographs.n_contacts, np.zeros(1, dtype=np.int64)
        self.switches = np.zeros(3, dtype=np.int64)
        motions = line.further_motions(len(changes))
        for motion, start in zip(motions, starts, strict=True):
            motion.state.put(np.zeros_like(start), np.zeros_like(start), start)
        self._tangents = MarchTangents(
            [
                _tangent(change, motion, n, results)
                for change, motion, results in zip(changes, motions, self._by_tangent, strict=True)
            ],
            [
                # A linear chain has none.
                [head.stepped for head in heads if isinstance(head, SteppedHead)]
                for heads in zip(*others, strict=True)
            ],
            scheme.interaction.links.local,
            first,
            self.switches,
        )

    @property
    def results(self) -> np.ndarray:
        return self._by_tangent.transpose(1, 0, 2)

    @property
    def block(self) -> slice:
        """Steps of the latest block in ``rows`` and ``results``."""
        return self._block

    def _prepare(self, step: int, left: int) -> None:
        super()._prepare(step, left)
        self._tangents.first[0] = step

    def _finish(self) -> bool:
        raise RunBroken(
            "the forces of a step are not found by the compiled loop, which its derivatives need"
        )

    def _made(self, parts: StepParts, block: Block) -> Any:
        return native.TangentSteps(parts, block, self._tangents)


def _tangent(change: Change, motion: FurtherMotion, n: int, results: np.ndarray) -> Tangent:
    """A tangent at the start of a march with n contacts."""
    # Derivatives of the speeds of impact that a Hertzian law starts with [m/s].
    least_speeds = np.full(n, change.hertz[3] if change.hertz.size else 0.0)
    return Tangent(
        motion.free,
        motion.loads,
        change.matrices,
        change.rest,
        LinkChange(change.links, change.weights),
        [
            HeadChange(
                *head.arrays, state.copy(), [model.stepped for model in head.beside], head.step
            )
            for head, state in zip(change.heads, change.states, strict=True)
        ],
        change.drives,
        LawChange(change.law, change.hertz, least_speeds, np.zeros(n)),
        change.start,
        change.speed,
        results,
    )
