"""Measures of hard cases, and the limits that they must keep.

Limits that are no answer of a single case's are derived here:

`FALLS` : of the difference between runs of halved steps; first order is 0.5, second order 0.25,
    and droppers that switch a step earlier or later spread these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from catenary.base.mpi import MPI
from catenary.base.parallel import on_root
from catenary.cases.process.workers import WorkerLost
from catenary.cases.scene.scene import resolved
from catenary.cases.studies.hard import runs as hard_runs
from catenary.cases.studies.hard.cases import HardCase
from catenary.cases.studies.hard.runs import RunHistories, cut_of, rest_height
from catenary.cases.studies.records import NOTHING_KEPT, KeptRows
from catenary.postproc.report.study_table import Column, StudyTable, file_table, remark_lines
from catenary.solver.model.beam import shape_slopes
from catenary.solver.problem.defects import DropperBreak, LineIncident, in_steps
from catenary.solver.statics.line_at_rest import LineAtRest

# Gauss's rule of three points is exact for the square of a cubic's slope.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)


class Left(NamedTuple):
    """Energy that left in a step [J]: observed in the balance of the run, and expected by
    theory."""

    step: int
    observed: float
    expected: float


def energy_that_left(rest: LineAtRest, run: RunHistories) -> list[Left]:
    """Energy that left the line at each incident of a watched run. Not collective.

    A dropper takes along the T^2 / 2k that its tension T at that time has stored. A wire whose
    tension falls from T to T' gives (T - T') / 2 times the integral of z'^2 to its tensioner, z'
    being its slope then, pre-sag and motion included.
    """
    found: list[Left] = []
    shares: dict[str, float] = {}
    seen: Sequence[LineIncident] = ()
    balance = run.energy - run.work
    for happened in in_steps(rest.problem.incidents, rest.problem.numerics.dt):
        force, displacement = run.kept[happened.step]
        new = happened.incidents[len(seen) :]
        expected = sum(_leaves(rest, incident, shares, force, displacement) for incident in new)
        observed = float(balance[happened.step] - balance[happened.step + 1])
        found.append(Left(happened.step, observed, expected))
        seen = happened.incidents
    return found


def _leaves(
    rest: LineAtRest,
    incident: LineIncident,
    shares: dict[str, float],
    force: np.ndarray,
    displacement: np.ndarray,
) -> float:
    mesh, line = rest.model.mesh, rest.problem.line
    if isinstance(incident, DropperBreak):
        (number,) = rest.model.droppers_at([incident.place])
        return float(rest.model.dropper_slopes.energy_under(force)[number])
    before = shares.get(incident.wire, 1.0)
    shares[incident.wire] = incident.share
    dofs, length = rest.model.wire_elements(incident.wire)
    form, pairs = rest.form, mesh.elements(incident.wire)
    at = np.stack([form.height[pairs], form.slope[pairs]], axis=2)
    shape = at.reshape(-1, 4) + displacement[dofs]
    total = 0.0
    for values, h in zip(shape, length, strict=True):
        slopes = [shape_slopes(0.5 * (1.0 + point), h) @ values for point in _POINTS]
        total += 0.5 * h * float(_WEIGHTS @ np.square(slopes))
    return 0.5 * (before - incident.share) * line.wire(incident.wire).tension * total


FALLS = 0.6
# Energy that rises by less [-] is round-off of some thousand steps: of its largest value.
ROUND_OFF = 1e-9


class Criterion(NamedTuple):
    """A figure and its limit; ``passed`` if ``value`` lies on the right side of ``limit``."""

    case: str
    name: str
    value: float
    limit: float
    passed: bool
    note: str = ""


class Checked(NamedTuple):
    """Measures of a hard case, and the remarks of the runs of its forms."""

    found: list[Criterion]
    remarks: dict[str, list[str]]


def check_cases(
    cases: Sequence[HardCase],
    comm: Any,
    short: bool = False,
    kept: KeptRows = NOTHING_KEPT,
    n_at_once: int = 1,
    initialise: Callable[[], object] | None = None,
) -> Iterator[Checked]:
    """Run hard cases in all their forms and measure them, or give what is kept. Collective.

    Parameters
    ----------
    comm : agreement of its ranks is measured if there are several
    short : the case's short form; steps are halved once only then
    kept : results of earlier calls
    n_at_once : cases that are run at the same time, 1 on several ranks
    initialise : called first in each further process
    """

    def depends_on(case: HardCase) -> dict[str, Any]:
        scene = resolved(case.scene(short))
        return {"case": case.model_dump(), "scene": scene, "short": short, "ranks": comm.size}

    outcomes = kept.each(partial(_checked, short), cases, depends_on, n_at_once, comm, initialise)
    for case, outcome in zip(cases, outcomes, strict=True):
        if isinstance(outcome.error, WorkerLost):
            yield Checked([holds_or_not(case, "runs to its end", False, str(outcome.error))], {})
        else:
            found, remarks = outcome.get()
            yield Checked([Criterion(*row) for row in found], remarks)


def _checked(short: bool, case: HardCase, comm: Any) -> Checked:
    """Measures of a hard case. Collective."""

    one = _OneCase(case, MPI.COMM_SELF, short)
    checked: Checked = on_root(comm, one.checked, takes_long=True)
    if comm.size > 1:
        checked.found.append(one.by_ranks(comm))
    return checked


class _OneCase:
    """A hard case: its runs in all forms, criteria on them, and their remarks by name."""

    def __init__(self, case: HardCase, alone: Any, short: bool) -> None:
        self.case, self.alone, self.short = case, alone, short
        self.remarks: dict[str, list[str]] = {}

    def checked(self) -> Checked:
        """All criteria but agreement of ranks. Not collective."""
        return Checked(list(self._criteria()), self.remarks)

    def _rest(self, halvings: int = 0, fixed_point: bool = False) -> LineAtRest:
        scene = self.case.scene(self.short, halvings, fixed_point)
        return hard_runs.at_rest(scene, self.alone)

    def _marched(self, form: str, rest: LineAtRest, with_work: bool = False) -> RunHistories:
        made = hard_runs.run(rest, self.alone, with_work, self_watched=True)
        self.remarks[f"{self.case.name} {form}".strip()] = made.remarks
        return made

    def _below(self, name: str, value: float, limit: float, note: str = "") -> Criterion:
        return Criterion(self.case.name, name, value, limit, bool(value <= limit), note)

    def _reaches(self, name: str, value: float, limit: float) -> Criterion:
        value = float(value)
        return Criterion(self.case.name, name, value, limit, value >= limit, "at least")

    def _holds(self, name: str, holds: bool, note: str = "") -> Criterion:
        return holds_or_not(self.case, name, holds, note)

    def _criteria(self) -> Iterator[Criterion]:
        case, rest = self.case, self._rest()
        if case.kind == "free":
            n_steps = case.short_steps if self.short else case.steps
            freed = hard_runs.run_free(rest, self.alone, n_steps)
            drift = float(np.abs(freed.energy / freed.energy[0] - 1.0).max())
            yield self._below("relative change of energy", drift, case.energy_gain)
            return
        base = self._marched("", rest, with_work=True)
        yield self._holds("runs to its end", base.outcome == "done", base.outcome)
        if base.outcome != "done":
            return
        yield self._holds("everything is finite", base.all_finite)
        lifted = np.abs(base.wire - rest_height(rest, base.position)).max()
        largest = float(base.force.max())
        yield self._below("largest contact force [N]", largest, case.force_below_N)
        yield self._below("largest lift [m]", float(lifted), case.uplift_below_m)
        halved = self._marched("at half the step", self._rest(1), with_work=True)
        yield from self._energy(base, halved)
        if case.refined and not self.short:
            quartered = self._marched("at a quarter of the step", self._rest(2))
            first, second = _apart(base, halved), _apart(halved, quartered)
            ratio = second / first if second > case.same else 0.0
            note = f"differences {first:.1e}, {second:.1e} of the deviation"
            name = "difference after halving the step twice to once"
            yield self._below(name, ratio, FALLS, note)
        if case.fixed_point != "left out":
            corrected = self._rest(fixed_point=True)
            yield self._correction(base, self._marched("by fixed-point correction", corrected))
        yield from self._needs(rest, base)

    def _energy(self, base: RunHistories, halved: RunHistories) -> Iterator[Criterion]:
        """Energy is not made, or, where switches of droppers make some, less with smaller steps.

        Contact makes none, however it switches. Of droppers the gains and losses may cancel in one
        run and not in the other: what one of them may make in one switch is allowed where the case
        allows energy at all.
        """
        gain, allowed = base.energy_gain(), self.case.energy_gain
        one_switch = min(halved.one_switch / halved.energy_scale(), allowed)
        limit = max(FALLS * gain, one_switch, ROUND_OFF)
        yield self._below("energy made by the integration", gain, allowed)
        yield self._below("energy made at half the step", halved.energy_gain(), limit)

    def _correction(self, base: RunHistories, other: RunHistories) -> Criterion:
        """The paper's correction agrees, or breaks where the table says so."""
        if self.case.fixed_point == "breaks":
            name = "the fixed-point correction breaks"
            return self._holds(name, other.outcome != "done", other.outcome)
        if other.outcome != "done":
            return self._holds("the fixed-point correction ends", False, other.outcome)
        apart = float(np.abs(other.height - base.height).max())
        return self._below("fixed-point correction, head height [m]", apart, self.case.schemes_m)

    def _needs(self, rest: LineAtRest, base: RunHistories) -> Iterator[Criterion]:
        """Whether the run was the hard one that the case is named after."""
        needs = self.case.needs
        for key, (name, measure) in _REACHED.items():
            if limit := getattr(needs, key):
                yield self._reaches(name, measure(rest, base), float(limit))
        if needs.lost_share_below is not None:
            share = float((base.force[base.time.size // 2 :] == 0.0).mean())
            yield self._below("share without contact", share, needs.lost_share_below)
        if needs.breaks_at_cut:
            far = float(np.abs(broken(rest, base) - cut_of(rest)).min(initial=np.inf))
            longest = float(np.diff(rest.model.contact_x).max())
            yield self._below("broken dropper to the boundary [m]", far, longest)
        if needs.energy_leaves is not None:
            left = energy_that_left(rest, base)
            off = max(abs(one.observed / one.expected - 1.0) for one in left)
            note = ", ".join(f"{one.expected:.3g} J at step {one.step}" for one in left)
            yield self._below("energy that leaves, relative", off, needs.energy_leaves, note)
        if needs.no_force_after_s is not None:
            late = base.force[base.time > needs.no_force_after_s]
            name = f"force after {needs.no_force_after_s:g} s [N]"
            yield self._below(name, float(late.max()), 0.0)
        if needs.ends_at_m is not None:
            last = float(base.position[-1, 0])
            yield self._reaches("end of the run [m]", last, needs.ends_at_m - 0.2)

    def by_ranks(self, world: Any) -> Criterion:
        """One rank against all of ``world``. Collective."""
        case, name = self.case, f"1 and {world.size} ranks, relative"
        rest = hard_runs.at_rest(case.scene(self.short), world)

        def run(comm: Any) -> RunHistories:
            if case.kind == "free":
                return hard_runs.run_free(rest, comm, case.short_steps)
            return hard_runs.run(rest, comm)

        together = run(world)

        def compare() -> Criterion:
            one = run(self.alone)
            if case.kind == "free":
                apart = np.abs(together.energy / one.energy - 1.0).max()
            elif one.force.shape != together.force.shape:
                return self._holds(name, False, together.outcome)
            elif case.ranks_m is not None:
                apart = np.abs(together.height - one.height).max()
                heights = f"1 and {world.size} ranks, head height [m]"
                return self._below(heights, float(apart), case.ranks_m)
            else:
                apart = np.abs(together.force - one.force).max() / np.abs(one.force).max()
            return self._below(name, float(apart), case.ranks)

        result: Criterion = on_root(world, compare, takes_long=True)
        return result


def holds_or_not(case: HardCase, name: str, holds: bool, note: str = "") -> Criterion:
    """A criterion of a case without a figure: whether it ``holds``, and a ``note`` for people."""
    return Criterion(case.name, name, float(holds), 1.0, holds, "" if note == "done" else note)


def _apart(coarse: RunHistories, fine: RunHistories) -> float:
    """Rms difference of head heights at the coarser run's times over their deviation."""
    n = min(coarse.time.size, (fine.time.size + 1) // 2)
    difference = coarse.height[:n] - fine.height[::2][:n]
    return float(np.sqrt((difference**2).mean()) / fine.height.std())


def _crossing(rest: LineAtRest, base: RunHistories) -> float:
    step = int(np.argmax(base.position[:, 0] > cut_of(rest)))
    return float(base.switches()[step - 1])


def _on_nodes(rest: LineAtRest, base: RunHistories) -> float:
    far = np.abs(base.position.reshape(-1, 1) - rest.model.contact_x).min(axis=1)
    return float((far < 1e-9).sum())


# By key of ``Needs``, what must reach its value, or true 1: a name, and how it is measured.
_REACHED: dict[str, tuple[str, Callable[[LineAtRest, RunHistories], float]]] = {
    "switches": ("switches of droppers", lambda rest, base: base.switches().sum()),
    "passes": ("passes between wires", lambda rest, base: passes(base)),
    "stopped": ("steps at an uplift stop", lambda rest, base: base.stops.any(axis=1).sum()),
    "lost_m": ("way without contact [m]", lambda rest, base: lost_way(base)),
    "on_nodes": ("steps on a node", _on_nodes),
    "crossing": ("switches at the crossing", _crossing),
    "touches_after_s": (
        "first contact [s]",
        lambda rest, base: base.time[np.argmax(base.force[:, 0] > 0.0)],
    ),
    "breaks": ("droppers that break", lambda rest, base: broken(rest, base).size),
}


def passes(run: RunHistories) -> int:
    """Number of changes of the contact wire with the greatest force, over all pantographs.

    Steps without contact are left out.
    """
    n = run.force.shape[1]
    shares = run.on_wires.reshape(len(run.on_wires), n, -1)
    touched = [own[own.any(axis=1)].argmax(axis=1) for own in np.moveaxis(shares, 1, 0)]
    return int(sum(np.count_nonzero(np.diff(first)) for first in touched))


def broken(rest: LineAtRest, run: RunHistories) -> np.ndarray:
    """Places of the droppers that carry up to an incident and never after [m]."""
    found = []
    for happened in in_steps(rest.problem.incidents, rest.problem.numerics.dt):
        before, after = run.taut[happened.step], run.taut[happened.step + 1 :]
        found.append(np.flatnonzero(before & ~after.any(axis=0)))
    mesh = rest.model.mesh
    return np.asarray(mesh.x(mesh.droppers[np.unique(np.concatenate([*found, []]).astype(int)), 1]))


def lost_way(run: RunHistories) -> float:
    """Longest way between two contacts of the leading pantograph [m]."""
    touched = run.position[run.force[:, 0] > 0.0, 0]
    return float(np.diff(touched).max(initial=0.0))


# By case and run of it, sentences about what decides the run's results.
Remarks = Mapping[str, Mapping[str, Sequence[str]]]
# Criteria that nearly all cases have, and the heads of their columns.
_COLUMNS = {
    "largest contact force [N]": ("force [N]", ".0f"),
    "largest lift [m]": ("lift [m]", ".2g"),
    "energy made by the integration": ("energy made", ".2g"),
    "energy made at half the step": ("at half the step", ".2g"),
    "difference after halving the step twice to once": ("refinement", ".2g"),
    "fixed-point correction, head height [m]": ("schemes [m]", ".2g"),
}
# Criteria without a figure.
_PLAIN = ("runs to its end", "everything is finite", "the fixed-point correction breaks")


def criteria(found: Sequence[Criterion], remarks_of: Remarks) -> StudyTable:
    """Table of criteria, a row each; ``remarks_of`` gives each case that has any a row with its
    remarks."""
    names = ("case", "criterion", "value", "limit", "kept", "note")
    kept = {True: "yes", False: "no"}
    rows: list[tuple[str, ...]] = [
        (one.case, one.name, f"{one.value:.3g}", f"{one.limit:.3g}", kept[one.passed], one.note)
        for one in found
    ]
    for case, remarks in remarks_of.items():
        texts = [f"{run}: {text}" for run, own in remarks.items() for text in own]
        if texts:
            rows.append((case, "remarks", str(len(texts)), "", "", "; ".join(texts)))
    return file_table(names, rows)


def page(cases: Sequence[HardCase], found: Sequence[Criterion], remarks_of: Remarks) -> str:
    """A table of Markdown with a line for each case, of the criteria ``found``; below it
    ``remarks_of`` each case."""
    columns = [
        Column("case", "case"),
        Column("words", "difficulty; *expected result*"),
        *(Column(name, *shown) for name, shown in _COLUMNS.items()),
        *(Column(name, name) for name in ("others", "remarks", "kept")),
    ]
    rows = []
    for case in cases:
        own = {row.name: row for row in found if row.case == case.name}
        others = "; ".join(
            f"{row.name} {float(f'{row.value:.3g}'):g}"  # three digits, powers from a million on
            for name, row in own.items()
            if name not in _COLUMNS and (name not in _PLAIN or not row.passed)
        )
        rows.append(
            {name: row.value for name, row in own.items() if name in _COLUMNS}
            | {
                "case": f"`{case.name}`",
                "words": f"{case.what}; *{case.right}*",
                "others": others,
                "remarks": sum(map(len, remarks_of.get(case.name, {}).values())) or None,
                "kept": "yes" if all(row.passed for row in own.values()) else "**no**",
            }
        )
    lines = [StudyTable(columns, rows).markdown()]
    below = remark_lines(run for remarks in remarks_of.values() for run in remarks.items())
    if below:
        lines += ["", *(f"- {line.split(maxsplit=1)[1]}" for line in below)]
    return "\n".join(lines) + "\n"


def line(row: Criterion) -> str:
    """A criterion for a terminal."""
    mark = "kept  " if row.passed else "BROKEN"
    note = f"  ({row.note})" if row.note else ""
    return f"    {mark}  {row.name:48} {row.value:10.3g}  limit {row.limit:9.3g}{note}"
