"""Steps of the scheme ``one_solve`` on one rank as one compiled loop, and what it is called with.

It calls the kernels that a step from Python calls, with the same arguments: what is said of these
there holds here. Not collective.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from catenary.mbs.head import head_records
from catenary.solver.base.kernels.compiled import compiled, inner
from catenary.solver.base.kernels.pointers import borrowed, call_held, numbers_at
from catenary.solver.contact import contact_kernels
from catenary.solver.contact.crossing_kernels import find_across
from catenary.solver.contact.train import output_kernels
from catenary.solver.contact.train.place_kernels import move_contacts
from catenary.solver.contact_problem import complementarity_kernels
from catenary.solver.contact_problem.complementarity_kernels import SmallProblem
from catenary.solver.contact_problem.law_tangents import ReportedForces
from catenary.solver.integrators import state_kernels
from catenary.solver.window.window_kernels import take_in

# Numbers of ``counts``, named as in `schemes.Counters`.
ROUNDS, SLACK, REPEATED = 0, 1, 2
# Beside these whether the loop has ended as there is no room for a motion.
FULL = 3
N_COUNTS = 4
# In place of a number of compensations: forces are left to others, or bounds were too small.
LEFT, TOO_SMALL = -1, -2


class KeptMotions(NamedTuple):
    """What is kept of steps that the line goes on from, see ``ShownMotion``.

    Attributes
    ----------
    motion_of : (n,) number of the motion that keeps a step, -1 if none does
    numbers : (m,) room for displacements and velocities, one motion after another
    stations : (k, 3) of each motion the stations that are kept, first and one after the last, and
        where its numbers begin
    used : (1,) how much of the room is
    moved : ``ShownMotion.moved``
    taps : (l,) addresses of numbers that are kept with a motion
    tapped : (k, l) room for these
    """

    motion_of: np.ndarray
    numbers: np.ndarray
    stations: np.ndarray
    used: np.ndarray
    moved: np.ndarray
    taps: np.ndarray
    tapped: np.ndarray


class Steps(NamedTuple):
    """What steps are made of: the first arguments of ``take``, in its order.

    It takes them one by one. Each use of a tuple is compiled with the types of all that is in it,
    which as one took twice as long.

    Attributes
    ----------
    speed : of the train [m/s]
    moving : arguments of ``move_contacts`` but the way
    placing, responding : arguments of ``place`` and ``respond``
    problem : SmallProblem of a step's forces
    superposing, compensating : of ``superpose`` and ``compensate`` after the forces
    working : of ``add_work`` after the forces
    crossing : arguments of ``wires_across.find_across``
    lateral_place : (n,) where wires that move sideways are on the strips [m]
    shown : of the line, see ``state_kernels.show``
    free : address of the line's free step, see ``pointers.call_held``
    loading : address of what finds loads that change with time, zeros if there are none
    clock : (1,) the time that it reads [s]
    records : of all heads, ``head_records.HEAD``
    heads : (2 n + 2 n^2,) all strips as functions of the forces, see ``HeadState``
    law : which forces the contact law reports
    ends : contacts of each strip and strips of each pantograph
    switched : (m,) int, room for the numbers of links with a row
    outputs : outputs of the pantographs, of which ``of_step`` is filled by a step
    taps : (k,) int, addresses of the numbers of further channels, see ``RowLayout``
    """

    speed: float
    moving: tuple[Any, ...]
    placing: tuple[Any, ...]
    free: tuple[int, int]
    loading: tuple[int, int]
    clock: np.ndarray
    records: np.ndarray
    heads: np.ndarray
    responding: tuple[Any, ...]
    problem: SmallProblem
    law: ReportedForces
    superposing: tuple[Any, ...]
    compensating: tuple[Any, ...]
    working: tuple[Any, ...]
    crossing: tuple[Any, ...]
    lateral_place: np.ndarray
    switched: np.ndarray
    ends: output_kernels.Ends
    of_step: np.ndarray
    outputs: np.ndarray
    shown: state_kernels.Shown
    taps: np.ndarray


@inner
def report(time, force, law):
    """Whether the contact law holds for ``force`` (n,) at ``time`` [s]; if so it is remembered.

    A law with ``gamma`` > 0 remembers forces and reports their mean over the step, as
    `KinematicInSteps` does.
    """
    gamma, before, reported = law.gamma, law.latest, law.reported
    if gamma == 0.0:
        for i in range(force.size):
            reported[i] = force[i]
        return True
    for i in range(force.size):
        if time > law.from_time and gamma * force[i] + (1.0 - gamma) * before[i] < 0.0:
            return False
    for i in range(force.size):
        reported[i] = gamma * force[i] + (1.0 - gamma) * before[i]
        before[i] = force[i]
    return True


@inner
def find_forces(time, problem, law, switched, n, counts):
    """Contact forces and compensations into the solution of the problem.

    Returns the number of links with a compensation, ``TOO_SMALL``, or ``LEFT``.
    """
    flags, solution = problem.flags[0], problem.unknowns.solution
    if flags.broken or flags.missing or n + int(flags.rows) > solution.size:
        return LEFT
    rounds, size, finite, complete = complementarity_kernels.solve(problem)
    if rounds <= 0 or not finite:
        return LEFT
    if not complete:
        return TOO_SMALL
    if not report(time, solution[:n], law):
        return LEFT
    counts[ROUNDS] += rounds
    for k in range(size - n):
        switched[k] = int(problem.rows.number[k])
        counts[SLACK] += solution[n + k] != 0.0 and problem.coupled.slackens[switched[k]]
    return size - n


@inner
def widen(bounds):
    """Double the bounds of what may switch."""
    bounds.loss[0] *= 2.0
    for i in range(bounds.push.size):
        bounds.push[i] *= 2.0
        bounds.pull[i] *= 2.0


@inner
def keep(kept, number, motion, columns):
    """Keep the motion of a step as that of a number; whether there is room for it."""
    begin, end = columns.starts[kept.moved[0]], columns.starts[kept.moved[1]]
    size, at = end - begin, kept.used[0]
    if at + 2 * size > kept.numbers.size:
        return False
    x, y, z, shares = motion
    part = x[begin:end], y[begin:end], z[begin:end], shares
    state_kernels.displacements(part, kept.numbers[at : at + size])
    state_kernels.velocities(part, kept.numbers[at + size : at + 2 * size])
    stations = kept.stations[number]
    stations[0], stations[1], stations[2] = kept.moved[0], kept.moved[1], at
    kept.used[0] = at + 2 * size
    kept.moved[0], kept.moved[1] = columns.ends[0], columns.ends[1]
    for j in range(kept.taps.size):
        kept.tapped[number, j] = numbers_at(kept.taps[j], 1)[0]
    return True


@compiled
def take(
    speed,
    moving,
    placing,
    free,
    loading,
    clock,
    records,
    heads,
    responding,
    problem,
    law,
    superposing,
    compensating,
    working,
    crossing,
    lateral_place,
    switched,
    ends,
    of_step,
    outputs,
    shown,
    taps,
    times,
    drives,
    rows,
    moved,
    kept_motions,
    counts,
    shows,
    first,
    n_steps,
):
    """Take the steps from ``first`` on of ``n_steps`` to ``times`` [s], with ``drives`` of heads.

    See ``Steps`` for what comes before ``times``.

    If ``shows``, ``rows`` take what each shows; ``moved`` are ``now`` and ``behind`` of
    ``MovedStations``, beside which a row is up to date. ``kept_motions`` are ``KeptMotions``; where
    there is no room for one, its step is the last.

    Returns how many were taken, and whether the next one is begun: up to its free step, as its
    forces are left to others.
    """
    times, drives, rows = borrowed(times), borrowed(drives), borrowed(rows)
    now, behind = borrowed(moved[0]), borrowed(moved[1])
    kept, moving, clock = borrowed(kept_motions), borrowed(moving), borrowed(clock)
    placing, responding = borrowed(placing), borrowed(responding)
    records, heads = borrowed(records), borrowed(heads)
    problem, law, switched = borrowed(problem), borrowed(law), borrowed(switched)
    superposing, compensating = borrowed(superposing), borrowed(compensating)
    working = borrowed(working)
    crossing, lateral_place = borrowed(crossing), borrowed(lateral_place)
    ends, of_step, outputs = borrowed(ends), borrowed(of_step), borrowed(outputs)
    shown, taps = borrowed(shown), borrowed(taps)
    solution, depth, motion = problem.unknowns.solution, problem.found[0], shown.motion
    pressed = problem.heads
    n, n_outputs = problem.gap.place.size, outputs.size
    n_arms = n_outputs + shown.arms.size
    n_shown = n_arms + shown.droppers.law.size
    force = solution[:n]
    for i in range(first, n_steps):
        time = times[i]
        move_contacts(*moving, speed * time)
        contact_kernels.place(*placing)
        contact_kernels.begin_work(*working)
        if loading[0] != 0:
            clock[0] = time
            call_held(loading)
        call_held(free)
        take_in(now, shown.columns.ends)
        take_in(kept.moved, shown.columns.ends)
        within = True
        if lateral_place.size:
            find_across(*crossing)
            touches, across = crossing[1], crossing[4]
            for h in range(records.size):
                head_records.cross(records[h], drives[i, h], across, touches, lateral_place)
        for h in range(records.size):
            within &= head_records.predict(records[h], drives[i, h], heads, n)
        m = TOO_SMALL if within else LEFT
        while m == TOO_SMALL:
            contact_kernels.respond(*responding)
            m = find_forces(time, problem, law, switched, n, counts)
            if m == TOO_SMALL:
                widen(problem.bounds)
                counts[REPEATED] += 1
        if m < 0:
            return i - first, True
        contact_kernels.superpose(force, *superposing)
        if m:
            slack = solution[n : n + m]
            contact_kernels.compensate(switched[:m], slack, *compensating)
        contact_kernels.add_work(force, *working)
        for h in range(records.size):
            head_records.move(records[h], force)
        output_kernels.write_outputs(force, law.reported, pressed, depth, ends, of_step)
        if shows:
            row = rows[i]
            for j in range(n_outputs):
                row[j] = outputs[j]
            uplift, tension = row[n_outputs:n_arms], row[n_arms:n_shown]
            begin, end = min(now[0], behind[i, 0]), max(now[1], behind[i, 1])
            state_kernels.show(shown, uplift, tension, begin, end)
            for j in range(taps.size):
                row[n_shown + j] = numbers_at(taps[j], 1)[0]
            if kept.motion_of[i] >= 0 and not keep(kept, kept.motion_of[i], motion, shown.columns):
                counts[FULL] = 1
                return i + 1 - first, False
    return n_steps - first, False
