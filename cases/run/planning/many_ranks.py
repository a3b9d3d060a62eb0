"""Time of a step on many ranks: the line shared out, and messages by latency and bandwidth.

A step on p ranks of a line of n unknowns, c [s] each, takes

    t(p) = t0 + c (n / p + 2 o) + 2 m(o) + log2(p) (m(share) + m(reply)),   p > 1,

with t0 for contacts, pantographs and steps taken one by one on rank 0, o unknowns of overlap to
each of two neighbours, m(k) = latency + k / bandwidth. Reductions and broadcasts run over a tree.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from catenary.cases.run.planning.needs import Needs, needs_with_mesh
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.cost_model import STEP_OVERHEAD
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.solver.effects.build_model import numbering_of
from catenary.solver.problem.problem import Problem

# Bytes of a number; numbers before the answers in a share, before the forces in a reply, and links
# with their compensations that a reply has room for.
_BYTES, _FLAGS, _HEAD, _LINKS = 8, 4, 4, 32
# Time that a step takes longer by itself, as on several ranks, than in a block of steps: measured
# on lines of 25 to 1000 spans before and after there were blocks [s].
_ONE_BY_ONE = 1e-5


class Wire(NamedTuple):
    """Time of a message: ``latency`` [s] and ``per_byte`` [s/B]."""

    latency: float
    per_byte: float

    def message(self, n_bytes: float) -> float:
        """Time of a message [s]."""
        return self.latency + n_bytes * self.per_byte


class Sizes(NamedTuple):
    """Messages of a step [B]: to a neighbour, to rank 0 and back from there."""

    neighbour: int
    share: int
    reply: int


class Work(NamedTuple):
    """A step on one rank.

    Attributes
    ----------
    unknowns, spans : of the line
    step : time of a step on one rank [s]
    fixed : part of it that does not grow with the length of the line [s]
    sizes : of messages on several ranks
    """

    unknowns: int
    spans: int
    step: float
    fixed: float
    sizes: Sizes

    @property
    def overlap(self) -> float:
        """Unknowns that a rank solves for beyond its own to each side: about a span."""
        return self.unknowns / self.spans


class Predicted(NamedTuple):
    """A step on a number of ranks: whole, and its parts [s]."""

    ranks: int
    line: float
    neighbours: float
    tree: float
    fixed: float

    @property
    def step(self) -> float:
        """All of it [s]."""
        return self.line + self.neighbours + self.tree + self.fixed

    @property
    def messages(self) -> float:
        """Share of the messages [s]."""
        return self.neighbours + self.tree


def work_of(scene: Scene) -> Work:
    """Work of a step of a scene, whose mesh it makes. Not collective."""
    problem, mesh = problem_of(scene), mesh_of(scene)
    n_unknowns = numbering_of(problem, mesh).n_unknowns
    return work_in(problem, needs_with_mesh(scene, mesh), n_unknowns)


def work_in(problem: Problem, needs: Needs, n_unknowns: int) -> Work:
    """Work of a step of a problem: its time on one rank, by the estimate of ``catenary plan``, and
    its messages on several. Not collective."""
    n_spans = problem.line.n_spans
    contacts = sum(len(place.data.strips.offsets) for place in problem.train.placements)
    share = _FLAGS + 2 * contacts * (1 + contacts)
    reply = _HEAD + contacts + 2 * _LINKS
    sizes = Sizes(_BYTES * math.ceil(n_unknowns / n_spans), _BYTES * share, _BYTES * reply)
    step = needs.march / needs.n_steps
    return Work(n_unknowns, n_spans, step, min(STEP_OVERHEAD, step), sizes)


def predict(work: Work, wire: Wire, ranks: int) -> Predicted:
    """Predicted time of a step on ``ranks`` ranks, each with a core of its own.

    ``work`` is that of a step of the march, ``wire`` the cost of messages.
    """
    each = (work.step - work.fixed) / work.unknowns
    if ranks == 1:
        return Predicted(1, each * work.unknowns, 0.0, 0.0, work.fixed)
    sizes, levels = work.sizes, math.log2(ranks)
    return Predicted(
        ranks,
        each * (work.unknowns / ranks + 2.0 * work.overlap),
        2.0 * wire.message(sizes.neighbour),
        levels * (wire.message(sizes.share) + wire.message(sizes.reply)),
        work.fixed + _ONE_BY_ONE,
    )


# Messages between nodes of a cluster, where they were not measured: 5 us and 5 GB/s, which today's
# networks do better. They decide by how much ranks of short lines wait for each other.
USUAL = Wire(5e-6, 2e-10)


def march_on(problem: Problem, needs: Needs, n_unknowns: int, ranks: int) -> float:
    """Predicted time of a march on ``ranks`` ranks, each with a core of its own [s].

    Not collective. A march with a window takes one rank, whatever their number.
    """
    if ranks == 1 or problem.window.moves:
        return needs.march
    return needs.n_steps * predict(work_in(problem, needs, n_unknowns), USUAL, ranks).step
