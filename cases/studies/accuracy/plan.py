"""Runs that ``catenary accuracy`` needs: each setting once, whichever axes need it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import find_case
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.problem import resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.accuracy.axes import MODEL, Axis, Level, Reference
from catenary.cases.studies.sweep.jobs import Job
from catenary.cases.studies.sweep.variants import Variant, slug
from catenary.postproc.files.disk import plain

# Nothing but channels is recorded, so that what is timed is the march.
_ALWAYS = ("output.field_every_s=0", "output.energy_every_s=0")
AS_IT_IS = Level("as_it_is", ())


@dataclass(frozen=True)
class PlannedAxis:
    """An axis with its levels, the name of each one's run, and why others are not possible.

    ``runs`` and ``refused`` are by level name; ``reference`` and ``chains`` are names of runs, the
    latter none for models. ``step_alone`` are names of runs by level name, see ``Axis``.
    """

    axis: Axis
    levels: Sequence[Level]
    runs: dict[str, str]
    refused: dict[str, str]
    reference: str
    chains: tuple[tuple[str, ...], ...] = ()
    step_alone: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """Plan of a study: the case's name, axes, jobs, how often short runs are timed, and
    whether levels are those of the short form; ``overrides`` are those of the command line,
    ``asked`` the axes, of which some may have nothing to vary."""

    case: str
    axes: Sequence[PlannedAxis]
    jobs: Sequence[Job]
    repeats: int
    quick: bool = False
    overrides: Sequence[str] = ()
    asked: Sequence[str] = ()


@dataclass
class _Jobs:
    """Collects jobs; settings that make the same scene share one."""

    case: str
    overrides: Sequence[str]
    shortened: bool
    jobs: list[Job] = field(default_factory=list)
    known: dict[str, str] = field(default_factory=dict)

    def add(self, axis: str, level: Level) -> str:
        """The name of the run of a level; raises InputError if it makes no scene."""
        scene = load_scene(self.case, [*self.overrides, *level.assignments], self.shortened)
        content = json.dumps(plain(resolved(scene)), sort_keys=True)
        if content not in self.known:
            name = slug(f"{axis}__{level.name}")
            self.known[content] = name
            job = Job(Variant(name, level.assignments), scene, keep_results=False)
            self.jobs.append(job)
        return self.known[content]


def make_plan(
    case: str,
    axes: Sequence[Axis],
    overrides: Sequence[str] = (),
    shortened: bool = False,
    *,
    quick: bool = False,
    repeats: int = 3,
) -> Plan:
    """All checked runs. Not collective.

    Parameters
    ----------
    case : name, file or folder
    overrides : ``key=value`` each, for all runs
    shortened : apply the case's ``[test]`` table
    quick : few levels, a coarser reference
    repeats : how often a short run is timed, at least 1

    Raises
    ------
    InputError
        If the case itself or a reference is wrong. A level that is not possible for it is left
        out, and reported.
    """
    all_of_them = [*overrides, *_ALWAYS]
    scene = load_scene(case, all_of_them, shortened)
    collected = _Jobs(case, all_of_them, shortened)
    planned = [one for axis in axes for one in _planned(axis, scene, collected, quick)]
    if not planned:
        raise InputError(
            f"the axes {', '.join(axis.name for axis in axes)} have nothing to vary in "
            f"{scene.case.name}" + (", whose mesh is the user's own" if scene.mesh.file else "")
        )
    asked = [axis.name for axis in axes]
    return Plan(scene.case.name, planned, collected.jobs, repeats, quick, tuple(overrides), asked)


def _planned(axis: Axis, scene: Scene, jobs: _Jobs, quick: bool) -> Iterator[PlannedAxis]:
    """The axis with its runs; nothing if the scene has nothing to vary there."""
    levels = axis.chosen(scene, quick)
    if not levels:
        return
    if axis.reference is not None:
        pair: Reference = axis.reference(quick)
        reference = jobs.add(axis.name, pair.level)
        chains = tuple(tuple(jobs.add(axis.name, one) for one in chain) for chain in pair.chains)
    else:
        reference, chains = jobs.add(axis.name, AS_IT_IS), ()
    runs, refused, step_alone = {}, {}, {}
    file = find_case(jobs.case).absolute()  # a study is read by others, elsewhere
    for level in levels:
        try:
            runs[level.name] = jobs.add(axis.name, level)
            if axis.step_alone is not None:
                step_alone[level.name] = jobs.add(axis.name, axis.step_alone(level))
        except InputError as error:
            refused[level.name] = str(error).replace(f" in {file}", "")
    assert axis.kind == MODEL or chains
    yield PlannedAxis(axis, levels, runs, refused, reference, chains, step_alone)


def again(job: Job, number: int) -> Job:
    """The job under a name of its own, to be timed once more."""
    name = f"{job.variant.name}__again_{number}"
    return replace(job, variant=Variant(name, job.variant.assignments))
