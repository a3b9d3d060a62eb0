"""The train's pantographs: models on rank 0, their contacts' places on all ranks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from catenary.base.parallel import on_root
from catenary.mbs.build import (
    Operation,
    PantographData,
    has_joints,
    make_pantograph,
    steady_forces,
)
from catenary.mbs.head.pantograph import Pantograph
from catenary.mbs.head.stepping import CrossingPath, FollowedPath, LateralPath, Stepping
from catenary.mbs.interface import N_DRIVE, HeadState
from catenary.mbs.lumped import LumpedData
from catenary.mbs.vehicle import BaseMotion
from catenary.solver.contact.contact_wire import Candidates, ContactWires
from catenary.solver.kernels import native
from catenary.solver.problem.contact_laws import KinematicLaw
from catenary.solver.problem.problem import Placement, Problem, Simulated
from catenary.solver.statics.elasticity import Elasticity
from catenary.solver.wind import airflow


def leads_of(wires: ContactWires, wire: np.ndarray, rake: np.ndarray) -> native.Leads:
    """The leads of contacts with wires at rest. Not collective.

    A strip at the angle r to the cross-section meets the wire y(x) where x = middle + tan(r) y, the
    place along the track of which is straight between the points of the wire's course. Sway of the
    vehicle and lateral motion, which move the contact by tan(r) of theirs, are left out.

    Parameters
    ----------
    wires : ContactWires
        Contact wires at rest.
    wire : ndarray, shape (n,)
        Contact wire of each contact.
    rake : ndarray, shape (n,)
        Angle of its strip [rad], > 0 if the left end is ahead.
    """
    contact = np.flatnonzero(rake)
    middles, leads, first = [np.zeros(0)], [np.zeros(0)], [0]
    for number in contact.tolist():
        middle, y = _crossing(wires, int(wire[number]), float(rake[number]))
        middles.append(middle)
        leads.append(math.tan(rake[number]) * y)
        first.append(first[-1] + middle.size)
    return native.Leads(contact, np.array(first), np.concatenate(middles), np.concatenate(leads))


def _crossing(wires: ContactWires, wire: int, rake: float) -> tuple[np.ndarray, np.ndarray]:
    """Places of the middle of a strip at an angle [rad] to the cross-section, ascending, and where
    a wire at rest crosses it there, to the left [m], straight in between."""
    x, y = wires.course(wire)
    middle = x - math.tan(rake) * y
    ascends = np.append(True, np.diff(np.maximum.accumulate(middle)) > 0.0)
    return middle[ascends], y[ascends]


class Heads(HeadState):
    """Heads over all n contacts of a train in one state; pantographs fill their parts of it.

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


class Pantographs:
    """All pantographs of a train, n of them, with their strips. Collective to make.

    Each strip may touch each contact wire: these are the contacts, strip by strip.

    Each is placed at the lowest wire at rest above its strips, or ``start_below`` that. With a
    kinematic contact it is placed at the wire above its middle and already moves up and down with
    that under way, V dw/dx: a head at rest would have to be brought to that within one step.

    Attributes
    ----------
    models : the models on rank 0, empty elsewhere
    n_contacts : number of strips times contact wires
    candidates : Candidates for contacts (n_contacts,), all ranks
    position : (n,) of the pantographs along the track [m], all ranks
    contact_force, head_height, wire_height : (n,) after the latest step, rank 0 only: the sum over
        a pantograph's strips, and their means
    strip_force : (n_strips,) the sum over the wires that each strip touches
    contact_wire_force : (n * n_wires,) the sum over the strips that touch each wire, pantograph by
        pantograph; empty if there is one wire
    joints_in_loop : whether a pantograph has joints that may open, all ranks
    constraint_violation : (n,) largest open joint after the latest step [m], NaN for pantographs
        without joints in the loop, rank 0 only
    across : (3, n_contacts) where lateral motion is simulated: where the wires are across the track
        [m], how fast that changes at the contacts [m/s] and how far they are from rest [m], rank 0
    lateral_place : (n_contacts,) then, else (0,): where wires are on the strips, to the left of
        their middle [m], NaN where a wire is not on its strip; rank 0
    lateral_displacement : the last of ``across``
    outputs : ``position`` and all these of the latest step one after another
    speed : of the train [m/s]
    nominal_height : head height at which the static force of a placement is defined [m]
    places_along : ``native.TrainPlaces``
    along_track : whether a base or the air at a pantograph depends on its place, rank 0
    reach : how far contacts are behind and ahead of their pantographs at most [m], all ranks
    ends : ``native.StripEnds``, contacts of each strip and strips of each pantograph
    work : of the contact forces on this rank's part of the line

    Raises
    ------
    CatenaryError
        On all ranks, if a pantograph does not reach the wire.
    """

    def __init__(
        self,
        comm: Any,
        problem: Problem,
        simulated: Simulated,
        wires: ContactWires,
        nominal_height: Callable[[Placement], float],
    ) -> None:
        train = problem.train
        self._wires = wires
        self._start = np.array([train.start - p.behind for p in train.placements])
        self.speed, self.nominal_height = train.speed, nominal_height
        n_wires = wires.n_wires
        self._data = [_simulated(placement, simulated, n_wires) for placement in train.placements]
        strips = [data.strips for data in self._data]
        offsets = np.concatenate([own.offsets for own in strips])
        counts = np.array([own.number for own in strips])
        of_pantograph = np.cumsum([0, *counts])
        self.ends = native.StripEnds(n_wires * np.arange(offsets.size + 1), of_pantograph)
        self._contacts = [
            slice(int(a), int(b)) for a, b in itertools.pairwise(n_wires * of_pantograph)
        ]
        strip_start = np.repeat(self._start, counts) + offsets
        # Places of contacts and of pantographs move together, in one sum.
        self.n_contacts = n_wires * strip_start.size
        all_start = np.concatenate([np.repeat(strip_start, n_wires), self._start])
        shares = self.n * n_wires if n_wires > 1 else 0
        sizes = (self.n, 3 * self.n, strip_start.size, shares, self.n)
        places_and_outputs = np.zeros(self.n_contacts + sum(sizes))
        all_places = places_and_outputs[: all_start.size]
        # A wire that is alone is never out of reach: beside the strips it runs on the horns.
        half_length = [own.half_length if n_wires > 1 else np.inf for own in strips]
        self.candidates = Candidates(
            places_and_outputs[: self.n_contacts],
            np.tile(np.arange(n_wires), strip_start.size),
            np.repeat(half_length, n_wires * counts),
        )
        rake = np.repeat([own.rake for own in strips], n_wires * counts)
        leads = leads_of(wires, self.candidates.wire, rake)
        self.places_along = native.TrainPlaces(all_start, all_places, leads)
        self._move = native.move_contacts.bound(self.places_along)
        self.reach = (
            max(0.0, -offsets.min()) - leads.lead.min(initial=0.0),
            max(0.0, offsets.max()) + leads.lead.max(initial=0.0),
        )
        self.outputs = places_and_outputs[self.n_contacts :]
        parts = np.split(self.outputs, np.cumsum(sizes)[:-1])
        self.position, forces, self.strip_force, self.contact_wire_force = parts[:-1]
        self.constraint_violation = parts[-1]
        self.move_to(0.0)
        self.contact_force, self.head_height, self.wire_height = forces.reshape(3, self.n)
        self.wire_height[:] = wires.rest_height(self._start)
        # Under a law with forces at a depth no strip may start within the wire.
        heads = self.wire_height
        if not isinstance(problem.contact, KinematicLaw):
            heads = self._lowest_above_strips()
        self.head_height[:] = heads - train.start_below
        self._write_outputs = native.write_outputs.bound(self)
        self._heads = Heads(self.n_contacts)
        numerics = problem.numerics
        gamma = numerics.gamma if numerics.integrator == "newmark" else 0.5
        self.work = _no_work(self.n_contacts, gamma, numerics.dt)
        self.across = np.zeros((3, self.n_contacts if simulated.lateral else 0))
        self.lateral_displacement = self.across[2]
        self.lateral_place = np.zeros(self.lateral_displacement.size)
        self.joints_in_loop = any(has_joints(placement.data) for placement in train.placements)
        self.constraint_violation[:] = np.nan
        self.models: list[Pantograph] = []
        self.along_track = False
        self._followed: list[FollowedPath] = []
        on_root(comm, lambda: self._make_all(problem, simulated, nominal_height), takes_long=True)

    def _lowest_above_strips(self) -> np.ndarray:
        """Lowest height of the wires at rest where strips of each pantograph are now, (n,) [m]."""
        places = self.candidates.place.reshape(-1, self.n_wires).T
        heights = [self._wires.rest_height_of(wire, x) for wire, x in enumerate(places)]
        lowest = np.fmin.reduce(heights)
        return np.fmin.reduceat(lowest, self.ends.of_pantograph[:-1])

    @property
    def n(self) -> int:
        """Number of pantographs."""
        return int(self._start.size)

    @property
    def n_wires(self) -> int:
        """Number of contact wires."""
        return self._wires.n_wires

    @property
    def lateral(self) -> bool:
        """Whether the wires move across the track."""
        return self.across.size > 0

    @property
    def n_strips(self) -> tuple[int, ...]:
        """Number of strips of each pantograph."""
        return tuple(np.diff(self.ends.of_pantograph).tolist())

    @property
    def most_contacts(self) -> int:
        """Number of contacts of the pantograph with the most."""
        return self._wires.n_wires * max(self.n_strips)

    def move_to(self, time: float) -> None:
        """Move pantographs and contacts to where they are at ``time`` [s]."""
        self._move(self.speed * time)

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Heights and velocities (n_contacts,) at ``time`` from the motion alone. Rank 0 only."""
        height, velocity = np.empty(self.n_contacts), np.empty(self.n_contacts)
        for model, strips in self._models_with_contacts:
            height[strips], velocity[strips] = model.extrapolate(time)
        return height, velocity

    def cross(self, time: float, present: np.ndarray) -> None:
        """Note where wires cross the strips at ``time`` [s], from ``across``.

        ``present`` (n_contacts,) is 0 where a wire is not on its strip. Does nothing where there
        are no models, or no lateral motion.
        """
        for path, contacts in zip(self._followed, self._contacts, strict=False):
            path.move_to(time)
            self.lateral_place[contacts] = path.place
        self.lateral_place[present[: self.lateral_place.size] == 0.0] = np.nan

    def predict(self, time: float) -> Heads:
        """Strips at ``time`` as functions of the contact forces. Rank 0 only."""
        for model, strips in self._models_with_contacts:
            self._heads.put(strips, model.predict(time))
        return self._heads

    def advance(self, contact_force: np.ndarray, reported: np.ndarray, depth: np.ndarray) -> None:
        """Advance all pantographs by a step and fill the recorded outputs. Rank 0 only.

        Parameters
        ----------
        contact_force : ndarray, shape (n_contacts,)
            Contact forces on the wire at the end of the step, upward [N].
        reported : ndarray, shape (n_contacts,)
            Contact forces that are recorded [N], see `LawInSteps.reported`.
        depth : ndarray, shape (n_contacts,)
            Heights of the strips above the wire at the contacts [m].
        """
        for model, strips in self._models_with_contacts:
            model.advance(contact_force[strips])
        self._write_outputs(contact_force, reported, self._heads.affine, depth)

    def places(self) -> list[np.ndarray]:
        """Places of masses and bodies of each pantograph now, see `Pantograph.places`; rank 0."""
        return [model.places() for model in self.models]

    def bases(self, time: float) -> list[float]:
        """Heights of the pantographs' bases at ``time`` [s], see `Pantograph.base`; rank 0 [m]."""
        return [model.base(time) for model in self.models]

    def heads_in_loop(self) -> tuple[list[native.Head], list[np.ndarray]]:
        """The heads as a loop of kernels steps them, and ``places``, which it keeps up to date."""
        return [model.stepped for model in self.models], self.places()

    def fill_drives(self, times: np.ndarray, drives: np.ndarray) -> None:
        """Fill in what ``heads_in_loop`` depend on in steps to ``times`` [s].

        ``drives`` (len(times), n, `interface.drive_width`).
        """
        for number, model in enumerate(self.models):
            model.fill_drives(times, drives[:, number])
            if self._followed:
                path = self._followed[number]
                path.fill_ahead(times, drives[:, number, N_DRIVE : N_DRIVE + 2 * path.place.size])

    def take_over(self, other: Pantographs) -> None:
        """Take over the state of ``other``, the same train at another time step. Not collective."""
        self.outputs[:] = other.outputs
        self.across[:], self.lateral_place[:] = other.across, other.lateral_place
        for mine, theirs in zip(self.models, other.models, strict=True):
            mine.restore(theirs.state())

    def _make_all(
        self,
        problem: Problem,
        simulated: Simulated,
        nominal_height: Callable[[Placement], float],
    ) -> None:
        """Make and place all models. Rank 0 only."""
        velocity, numerics = np.zeros(self.n), problem.numerics
        newmark = numerics.dt, numerics.beta, numerics.gamma
        if isinstance(problem.contact, KinematicLaw):
            velocity = self.speed * self._wires.rest_slope(self._start)
        for number, placement in enumerate(problem.train.placements):
            base = _base(problem, simulated, placement)
            path: CrossingPath | None = None
            if self.lateral:
                path = FollowedPath(self.across[:2, self._contacts[number]], base)
                self._followed.append(path)
            data, train = self._data[number], problem.train
            # It matters where wires cross the strips to a head that rolls or bends.
            if not (data.strips.flexure or (simulated.head_roll and data.roll)):
                path = None
            elif path is None:
                path = LateralPath(
                    [_crossing(self._wires, k, data.strips.rake) for k in range(self.n_wires)],
                    train.start - placement.behind,
                    data.strips.offsets,
                    train.speed,
                    base,
                )
            flow = airflow(problem, simulated, placement)
            self.along_track |= any(own is not None and own.along_track for own in (base, flow))
            operation = Operation(
                placement.static_force,
                nominal_height(placement),
                Stepping(train.raise_time, *newmark, path, base),
                flow,
                placement.lowering if simulated.lowering else None,
                placement.regulator if simulated.regulated_lift else None,
                simulated.head_roll,
            )
            model = make_pantograph(data, operation)
            model.violation = self.constraint_violation[number : number + 1]
            model.stepped.first = self._contacts[number].start
            model.place(float(self.head_height[number]), float(velocity[number]))
            self.models.append(model)
        self._models_with_contacts = list(zip(self.models, self._contacts, strict=True))


def _simulated(placement: Placement, simulated: Simulated, n_wires: int) -> PantographData:
    """Data of a pantograph below so many wires, without what is not simulated."""
    data = placement.data
    strips = replace(
        data.strips,
        wires=n_wires,
        flexure=data.strips.flexure if simulated.flexible_strips else None,
        rake=data.strips.rake * simulated.raked_strips,
    )
    return replace(data, strips=strips, laws=data.laws if simulated.pantograph_laws else ())


def _base(problem: Problem, simulated: Simulated, placement: Placement) -> BaseMotion | None:
    """Motion of a pantograph's base by the vehicle, None without any."""
    if simulated.vehicle is None:
        return None
    vehicle = replace(simulated.vehicle, suspension=simulated.suspension)
    train = problem.train
    return BaseMotion(vehicle, train.start - placement.behind, train.speed)


def nominal_height_rule(
    problem: Problem, simulated: Simulated, wires: ContactWires, elasticity: Elasticity
) -> Callable[[Placement], float]:
    """Head height at which the static force is defined.

    That of the placement, or else the mean height of a head that lifts the contact wires in the
    stretch of ``elasticity`` with the static force and that of still air at the train's speed, so
    that the base spring neither adds to the mean force nor takes from it. The head of a chain that
    is tied to its base stands above the wires by the depth of its contact law; others change
    their force by less than a hundredth over that depth, which is left out.
    """
    x = elasticity.x
    at_rest = np.stack([wires.rest_height_of(wire, x) for wire in range(wires.n_wires)], axis=1)

    def height(placement: Placement) -> float:
        if placement.nominal_height is not None:
            return placement.nominal_height
        force = placement.static_force
        data = _simulated(placement, simulated, wires.n_wires)
        if simulated.meets_air and data.meets_air:
            force += steady_forces(data, problem.train.speed).whole
        lifted = elasticity.pressed(at_rest, force)
        above = 0.0
        if isinstance(data, LumpedData) and data.tied:
            above = problem.contact.depth(force / len(data.strips.contact_offsets))
        # By trapezoids; scipy.integrate, which has the rule, loads solvers for 0.03 s.
        mean = float(np.sum(np.diff(x) * (lifted[1:] + lifted[:-1]) / 2.0) / (x[-1] - x[0]))
        return mean + above

    return height


def _no_work(n_contacts: int, share_after: float, dt: float) -> native.ContactWork:
    """Work of ``n_contacts`` contact forces before the first step of ``dt`` [s].

    ``share_after`` is the weight of the force at the end of a step [-], 1 less that at its start.
    """
    local, value = np.zeros((n_contacts, 4), dtype=np.int64), np.zeros((n_contacts, 4))
    force, before, ahead = np.zeros((3, n_contacts))
    shares = 1.0 - share_after, share_after
    return native.ContactWork(np.zeros(1), force, local, value, before, ahead, *shares, dt)
