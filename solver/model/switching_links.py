"""Links whose force is followed in the time loop, in one table in their order along the track.

A link of one sign switches where its force would change sign. Its *reserve* R is what is left until
then: the tension of a dropper, or what an open stop lacks to press. A link of K with R < 0 gets a
compensation s = released max(0, -R) beside what K does; for an open link, which K does not hold,
s = max(0, -R) is its force. Both act on the unknowns with -L s, so that the time loop treats both
alike: R = rest + k e + c e' with rest, k and c of an open link the negative ones of its law.

A *bend* is where the law of a link has another slope. It is a link of its own, which beyond its
place adds the change of slope times the way there to what the other link goes on doing as at rest:
with L where that pulls, with -L where it pushes, so that s = max(0, -R) of each. A table of slopes
has as many s as bends, and its link carries the sum.

A dependent link, *dependent* for short, is a link of K that carries while its leading link, its
*leader*, does: what a dropper's force does across it goes with the dropper. Where the leader has
R < 0, its dependents get s = -released R, of any sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from catenary.solver.kernels import native
from catenary.solver.model.link_directions import swings_of_droppers
from catenary.solver.model.links import BOTH, NO_BENDS, PUSHES, Bends, Links
from catenary.solver.model.model import Model

_SIDES: tuple[Literal["left"], Literal["right"]] = ("left", "right")
# Parts of a link's reserve, and its law beyond; see `kernels/motion/motion.hpp`.
RESERVE = native.RESERVE


NO_LINKS = native.Links(np.zeros((0, 2), np.int64), np.zeros((0, 2)), np.zeros(0, RESERVE))


def some_of(links: native.Links, which: np.ndarray | slice) -> native.Links:
    """Some of these links."""
    return native.Links(*(member[which] for member in links))


@dataclass(frozen=True)
class LinkTable:
    """All links that are followed, the same on every rank, in order of place; dependents right
    behind their leader.

    Attributes
    ----------
    arrays : native.Links with unknowns of the whole line
    components : names of components
    component, index : (n,) number of the component of each link, -1 for dependents and bends, and
        its number within the component
    leader : (n,) number of the link that each switches with, for most links their own
    bent : (n,) number of the link that a bend belongs to, -1 for others and if it is not followed
    pulls : (n,) force that a unit compensation of a bend adds to that of its link [-], 1 or -1
    broken : (n,) whether the link no longer carries anything
    half_length : (n,) largest distance of its unknowns from its place [m]
    switches : whether any link switches
    """

    arrays: native.Links
    components: tuple[str, ...]
    component: np.ndarray
    index: np.ndarray
    leader: np.ndarray
    bent: np.ndarray
    pulls: np.ndarray
    broken: np.ndarray
    half_length: np.ndarray

    @property
    def switches(self) -> bool:
        return bool(self.arrays.law["released"].any())

    @property
    def is_dependent(self) -> np.ndarray:
        """(n,) whether each switches with a link before it."""
        return np.asarray(self.leader != np.arange(self.leader.size))

    @property
    def slackens(self) -> np.ndarray:
        """(n,) mask of the links of K, which slacken; open links close instead."""
        return np.asarray(self.arrays.law["carried"] > 0.0)

    def bends_of(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of the bends of some links, link by link, and (k + 1,) where those of each
        begin."""
        by_link = np.argsort(self.bent, kind="stable")
        low, high = (np.searchsorted(self.bent[by_link], numbers, side) for side in _SIDES)
        begin = np.concatenate([[0], np.cumsum(high - low)])
        own = np.arange(begin[-1]) + np.repeat(low - begin[:-1], high - low)
        return by_link[own], begin

    def of_component(self, name: str) -> np.ndarray:
        """Numbers of a component's links, in its own order."""
        if name not in self.components:
            return np.zeros(0, dtype=np.int64)
        numbers = np.flatnonzero(self.component == self.components.index(name))
        return numbers[np.argsort(self.index[numbers])]


class _Part(NamedTuple):
    """k links of one origin before all are put in order.

    ``leader`` and ``bent`` are numbers in the order of the parts; ``component`` is empty for
    dependents and bends. The rest is as in `LinkTable`.
    """

    arrays: native.Links
    component: str
    leader: np.ndarray
    bent: np.ndarray
    pulls: np.ndarray
    broken: np.ndarray


def switching_links(model: Model, dropper_force: np.ndarray) -> LinkTable:
    """Droppers, all links of one sign, and bends; ``dropper_force`` (n_droppers,) at rest [N]. Not
    collective."""
    parts: list[_Part] = []
    for links in model.links:
        is_droppers = links is model.droppers
        arrays = _droppers(model, links, dropper_force) if is_droppers else _one_sign(model, links)
        broken = model.broken if is_droppers else np.zeros(arrays.law.size, dtype=bool)
        parts.append(_leading(parts, arrays, links.component, broken))
    firsts = np.cumsum([0, *(part.leader.size for part in parts)]).tolist()
    # With which link or bend each dropper slackens.
    slackens = np.zeros(0, dtype=np.int64)
    for links, first in zip(model.links, firsts, strict=False):
        bends, slack = links.bends, np.zeros(links.bends.link.size, dtype=bool)
        alpha = np.full(links.law.size, model.damping_of(links.component)[0])
        # Links that push are followed turned.
        given, turned = links.law["acts"] != BOTH, links.law["acts"] == PUSHES
        numbers = np.where(given, first + np.cumsum(given) - 1, -1)
        if links is model.droppers:
            bends, slack = _dropper_bends(model, dropper_force)
            alpha, slackens = _released_alpha(model), numbers.copy()
        sign = np.sign(bends.change * bends.side)
        arrays = _bends(links, bends, alpha[bends.link], sign)
        arrays.law["carried"][slack] = 1.0
        part = _leading(parts, arrays, "", np.zeros(slack.size, dtype=bool))
        slackens[bends.link[slack]] = part.leader[slack]
        pulls = np.where(turned[bends.link], -sign, sign)
        parts.append(part._replace(bent=numbers[bends.link], pulls=pulls))
    for arrays, droppers in _dependents(model):
        part = _leading(parts, arrays, "", np.zeros(droppers.size, dtype=bool))
        parts.append(part._replace(leader=slackens[droppers]))
    return _in_order(model, parts)


def _leading(
    before: Sequence[_Part], arrays: native.Links, component: str, broken: np.ndarray
) -> _Part:
    """Links behind those of other parts that are their own leaders and bend none."""
    n = arrays.law.size
    leader = sum(part.leader.size for part in before) + np.arange(n)
    return _Part(arrays, component, leader, np.full(n, -1), np.ones(n), broken)


def _in_order(model: Model, parts: Sequence[_Part]) -> LinkTable:
    """The table of all parts, in order of place."""
    # Two unknowns at least, which kernels take without a loop.
    m = max([2, *(part.arrays.unknowns.shape[1] for part in parts)])
    padded_parts = [padded(part.arrays, m) for part in parts]
    arrays = native.Links(*(np.concatenate(same) for same in zip(*padded_parts, strict=True)))
    # A force on an unknown that is held moves nothing.
    free = np.ones(model.n_dofs)
    free[model.constrained] = 0.0
    arrays = arrays._replace(weights=arrays.weights * free[arrays.unknowns])
    leader = np.concatenate([part.leader for part in parts])
    # By place, then by number; dependents stand behind the leaders of which they have the number.
    order = np.lexsort((leader, arrays.law["place"]))
    place_of = np.empty(order.size, dtype=np.int64)
    place_of[order] = np.arange(order.size)
    components = tuple(dict.fromkeys(part.component for part in parts if part.component))
    numbers = {name: number for number, name in enumerate(components)}
    component = np.concatenate(
        [np.full(part.leader.size, numbers.get(part.component, -1)) for part in parts]
    )
    index = np.zeros(component.size, dtype=np.int64)
    for number in range(len(components)):
        own = component == number
        index[own] = np.arange(np.count_nonzero(own))
    arrays = some_of(arrays, order)
    x = model.numbering.as_vector(model.mesh.points[:, :1])
    half_length = np.abs(x[arrays.unknowns] - arrays.law["place"][:, None]).max(axis=1)
    bent = np.concatenate([part.bent for part in parts])[order]
    return LinkTable(
        arrays,
        components,
        component[order],
        index[order],
        place_of[leader[order]],
        np.where(bent < 0, -1, place_of[bent]),
        np.concatenate([part.pulls for part in parts])[order],
        np.concatenate([part.broken for part in parts])[order],
        half_length,
    )


def _droppers(model: Model, links: Links, force: np.ndarray) -> native.Links:
    law, kept = np.zeros(links.law.size, dtype=RESERVE), model.simulated.kept_ratio
    law["rest"] = np.where(model.broken, 0.0, force)
    law["stiffness"], law["damping"] = links.law["stiffness"], model.released_damping
    law["place"], law["carried"] = links.law["place"], 1.0
    # Slackness is one more bend if another bend is nearer at rest.
    law["released"] = np.where(model.dropper_pieces.begin > 0.0, 0.0, 1.0 - kept)
    # A dropper slack at rest is an open link: its reserve is the force that it lacks to be taut.
    slack = (model.dropper_gap > 0.0) & ~model.broken
    law["rest"][slack] = (model.dropper_gap * law["stiffness"])[slack]
    law["stiffness"][slack] *= -1.0
    law["damping"][slack] *= -1.0
    law["carried"][slack] = -kept
    return native.Links(*links.direction, law)


def _released_alpha(model: Model) -> np.ndarray:
    """Ratio (n_droppers,) of the damping of droppers that goes slack with the spring to their
    stiffness [s]."""
    stiffness = model.dropper_stiffness
    none = np.zeros(stiffness.size)
    return np.divide(model.released_damping, stiffness, out=none, where=stiffness > 0.0)


def _dropper_bends(model: Model, force: np.ndarray) -> tuple[Bends, np.ndarray]:
    """Bends of droppers with several slopes, and which of them slacken (k,).

    A dropper whose spring is at rest on another piece than the first slackens with a bend.
    """
    slopes, on, kept = model.dropper_slopes, model.dropper_pieces, model.simulated.kept_ratio
    if not (model.droppers_bend and model.simulated.slackening):
        return NO_BENDS, np.zeros(0, dtype=bool)
    rest = np.where(
        model.dropper_gap > 0.0, -model.dropper_gap, on.begin + (force - on.force) / on.slope
    )
    side = np.where(slopes.begin > on.begin[:, None], 1.0, -1.0)
    # Below the first piece the slope is that of a slack dropper.
    less = np.concatenate([kept * slopes.slope[:, :1], slopes.slope[:, :-1]], axis=1)
    change = side * (slopes.slope - less)
    bends = (change != 0.0) & ~model.broken[:, None]
    bends[:, 0] &= on.begin > 0.0
    link, piece = np.nonzero(bends)
    stretch = (slopes.begin - rest[:, None])[bends]
    return Bends(link, stretch, side[bends], change[bends]), piece == 0


def _bends(links: Links, bends: Bends, alpha: np.ndarray, sign: np.ndarray) -> native.Links:
    """Bends as links: ``sign`` (k,) of the force by which each acts beyond, ``alpha`` (k,) damping
    over stiffness [s]."""
    law = np.zeros(bends.link.size, dtype=RESERVE)
    law["rest"] = bends.side * np.abs(bends.change) * bends.stretch
    law["stiffness"], law["damping"] = -bends.change, -alpha * bends.change
    law["place"], law["released"] = links.law["place"][bends.link], 1.0
    unknowns, weights = links.direction
    return native.Links(unknowns[bends.link], sign[:, None] * weights[bends.link], law)


def _dependents(model: Model) -> list[tuple[native.Links, np.ndarray]]:
    """Dependents of droppers that may slacken, and the numbers of these droppers."""
    found: list[tuple[native.Links, np.ndarray]] = []
    for direction, stiffness in swings_of_droppers(model):
        own = np.flatnonzero((stiffness > 0.0) & ~model.broken & (model.dropper_gap <= 0.0))
        law = np.zeros(own.size, dtype=RESERVE)
        law["stiffness"] = stiffness[own]
        law["damping"] = _released_alpha(model)[own] * law["stiffness"]
        law["place"] = model.droppers.law["place"][own]
        law["released"] = 1.0 - model.simulated.kept_ratio
        if law["released"].any():
            arrays = native.Links(direction.unknowns[own], direction.weights[own], law)
            found.append((arrays, own))
    return found


def _one_sign(model: Model, links: Links) -> native.Links:
    """Links of a set that act one way, turned so that they pull."""
    given = links.law["acts"] != BOTH
    own = links.law[given]
    turned = np.where(own["acts"] == PUSHES, -1.0, 1.0)
    law = np.zeros(own.size, dtype=RESERVE)
    # The reserve of a link of K is its force, of an open one what that lacks.
    sign = np.where(own["open"], -1.0, 1.0)
    alpha, _ = model.damping_of(links.component)
    law["rest"] = sign * turned * own["rest"]
    law["stiffness"] = sign * own["stiffness"]
    law["damping"] = sign * (own["damping"] + alpha * own["stiffness"])
    law["place"], law["released"] = own["place"], 1.0
    law["carried"] = ~own["open"]
    weights = turned[:, None] * links.direction.weights[given]
    return native.Links(links.direction.unknowns[given], weights, law)


def padded(links: native.Links, m: int) -> native.Links:
    """Pad links to m unknowns each, with their last one again, without weight."""
    more = m - links.unknowns.shape[1]
    unknowns = np.pad(links.unknowns, ((0, 0), (0, more)), mode="edge")
    weights = np.pad(links.weights, ((0, 0), (0, more)))
    return native.Links(unknowns.astype(np.int64), weights, links.law)
