"""Jobs of a sweep and how they ended. Imports no backend."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

from catenary.base.errors import InputError, RunBroken
from catenary.base.options import option
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.scene.input.case_files import Assigned
from catenary.cases.scene.input.faults import UnfitScene, shown, shown_word
from catenary.cases.scene.keys.keys import meant
from catenary.cases.scene.load import Draft, read_draft
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.turned import BACKWARD, turned
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.report.study_table import Column

# Statistics in a sweep's table: of a row's pantograph, and of the line.
OF_PANTOGRAPH = (
    Column("mean_N", "mean [N]", ".1f", "mean contact force [N]"),
    Column("std_N", "std [N]", ".1f", "standard deviation, 0-20 Hz [N]"),
    Column("std_0_5_N", meaning="standard deviation, 0-5 Hz [N]"),
    Column("std_5_20_N", meaning="standard deviation, 5-20 Hz [N]"),
    Column("max_N", "max [N]", ".1f", "maximum force [N]"),
    Column("min_N", "min [N]", ".1f", "minimum force [N]"),
    Column("stat_max_N", meaning="mean + 3 standard deviations [N]"),
    Column("stat_min_N", meaning="mean - 3 standard deviations [N]"),
    Column("loss_percent", "loss [%]", ".3f", "loss of contact [%]"),
    Column("arcing_percent", meaning="arcing NQ [%]"),
    Column("contact_height_range_mm", meaning="contact point, vertical range [mm]"),
)
OF_LINE = (
    Column("max_uplift_mm", "uplift [mm]", ".1f", "largest uplift at arms [mm]"),
    Column("n_slackened", "slackened", "d", "droppers slackened [-]"),
    Column("max_dropper_force_N", meaning="maximum dropper force [N]"),
    Column("min_dropper_force_N", meaning="minimum dropper force [N]"),
)
STATISTICS = {column.name: column for column in (*OF_PANTOGRAPH, *OF_LINE)}
# Tables of a summary that hold statistics of the line, and their keys there.
_IN_SUMMARY = {
    "max_uplift_mm": ("supports", "max_uplift_mm"),
    "n_slackened": ("droppers", "n_slackened"),
    "max_dropper_force_N": ("droppers", "max_force_N"),
    "min_dropper_force_N": ("droppers", "min_force_N"),
}
# Histories that an ensemble can keep of each pantograph, with unit and meaning.
HISTORIES = {
    "contact_force": ("N", "contact force, >= 0 in compression"),
    "filtered_force": ("N", "contact force, 0-20 Hz, on which statistics stand"),
    "head_height": ("m", "height of the pan head above top of rail"),
    "wire_height": ("m", "height of the contact wire above top of rail where the pan head is"),
}


def check_names(names: Sequence[str], known: Mapping[str, Any], what: str) -> None:
    """Raise InputError if one of ``names`` is none of ``known``, ``what`` being one of these."""
    for name in names:
        if name not in known:
            raise InputError(f"{shown_word(name)} is no {what}; {meant(name, list(known))}")


def statistics_of(summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """``pantograph`` and ``STATISTICS`` of each pantograph of a run, those of the line with each.

    What is not known is None. A run without a ``summary`` has a row without figures.
    """
    line = {name: summary.get(table, {}).get(key) for name, (table, key) in _IN_SUMMARY.items()}
    return [
        {"pantograph": one.get("name", "")}
        | {column.name: one.get(column.name) for column in OF_PANTOGRAPH}
        | line
        for one in summary.get("pantographs", [{}])
    ]


@dataclass(frozen=True)
class Job:
    """A variant with its scene and what is kept of its run.

    ``full_report`` draws the run's own report; without ``keep_results`` only the summary and what
    ``measure`` takes stay on the disk.
    """

    variant: Variant
    scene: Scene
    full_report: bool = False
    keep_results: bool = True


class RunOptions(NamedTuple):
    """Options for the runs of a sweep or study.

    Attributes
    ----------
    force : run all anew, whatever is there, and however large the runs are
    petsc : the options that PETSc was started with, for the record
    progress : called with a line before and after each run
    n_jobs : runs at the same time as the user wants them, 0 for as many as there are cores or ranks
    """

    force: bool = False
    petsc: Sequence[str] = ()
    progress: Callable[[str], None] = lambda line: None
    n_jobs: int = 1


AS_USUAL = RunOptions()


@dataclass(frozen=True)
class Ended:
    """Result of a variant.

    Attributes
    ----------
    variant : which one
    outcome : "done", "interrupted" or the sentence of what broke
    summary : content of ``summary.json``, empty unless done
    measured : values that ``Measure`` took, empty unless done
    wall : time that the run took [s], the earlier run's if it was not run again
    skipped : whether it was done already
    """

    variant: Variant
    outcome: str
    summary: dict[str, Any] = field(default_factory=dict)
    measured: dict[str, Any] = field(default_factory=dict)
    wall: float = 0.0
    skipped: bool = False

    @property
    def done(self) -> bool:
        """Whether the run came to its end."""
        return self.outcome == "done"

    @property
    def remarks(self) -> list[str]:
        """Sentences about what decides the results, none unless done."""
        return list(self.summary.get("remarks", []))


def interrupted(ended: Sequence[Ended]) -> bool:
    """Whether a signal ended the last of some runs, after which no other began."""
    return bool(ended) and ended[-1].outcome == "interrupted"


def all_ended(ended: Sequence[Ended], what: str = "study") -> list[Ended]:
    """The runs of a study, unless a signal ended it.

    Raises
    ------
    Interrupted
        If one did; ``what`` names the study.
    """
    if interrupted(ended):
        raise Interrupted(f"the {what} was interrupted; the same command continues it")
    return list(ended)


def all_done(ended: Sequence[Ended]) -> dict[str, Ended]:
    """The runs of a study by name.

    Raises
    ------
    RunBroken
        If one broke.
    """
    for one in ended:
        if not one.done:
            raise RunBroken(f"the run {one.variant.name} broke: {one.outcome}")
    return {one.variant.name: one for one in ended}


def _assigned(variant: Variant) -> list[Assigned]:
    """The assignments of a variant, each with what gave it."""
    own = len(variant.assignments) - len(variant.varied)
    by_name = f"by the variant {variant.name}"
    return [
        Assigned(text, "--vary", variant.where)
        if number >= own
        else Assigned(text, f"variant {variant.name}:", by_name)
        for number, text in enumerate(variant.assignments)
    ]


def _refuse_petsc(variant: Variant) -> None:
    """PETSc starts once, with the options of the first scene."""
    for assignment in variant.assignments:
        if assignment.split("=")[0].strip().split(".")[0] == "petsc":
            raise InputError(
                f"variant {variant.name} assigns {shown(assignment)[1:-1]}, but PETSc takes its "
                "options once, when the program starts: give them "
                f"{option('with --set or after --', 'to the scene by replace()')}"
            )


class WholeRuns(NamedTuple):
    """Variants of a case, each of which leaves a run in a folder of its own.

    Attributes
    ----------
    draft : the case
    variants : in their order
    jobs : of those that can be run
    refused : how the others ended
    """

    draft: Draft
    variants: Sequence[Variant]
    jobs: list[Job]
    refused: list[Ended]

    @property
    def first(self) -> Scene:
        """The scene of the first variant that can be run."""
        return self.jobs[0].scene


def whole_runs_of(
    draft: Draft, variants: Sequence[Variant], full_report: bool = False
) -> WholeRuns:
    """Whole runs of the ``variants`` of a case, ``draft``, with ``full_report`` a report of each.
    Not collective.

    A variant breaks alone if its values do not fit together or are implausible.

    Raises
    ------
    InputError
        As ``make_jobs``, if no variant can be run, or if a value of one is out of bounds.
    """
    runs, several = WholeRuns(draft, variants, [], []), len(variants) > 1
    for variant in variants:
        try:
            scene = scene_of(draft, variant, several=several)
            runs.jobs.append(Job(variant, scene, full_report))
        except UnfitScene as error:
            runs.refused.append(Ended(variant, str(error)))
    if runs.refused and not runs.jobs:
        first = runs.refused[0]
        raise InputError(
            f"variant {first.variant.name}: {first.outcome}" if several else first.outcome
        )
    return runs


def in_order(
    variants: Sequence[Variant], ended: Sequence[Ended], refused: Sequence[Ended]
) -> list[Ended]:
    """Variants that ``ended`` and that were ``refused`` in the order of ``variants``; an
    interruption comes last."""
    by_name = {one.variant.name: one for one in (*refused, *ended)}
    merged = [by_name[variant.name] for variant in variants if variant.name in by_name]
    return sorted(merged, key=lambda one: one.outcome == "interrupted")


def make_jobs(
    case: str,
    variants: Sequence[Variant],
    overrides: Sequence[str] = (),
    shortened: bool = False,
) -> list[Job]:
    """The checked scenes of ``variants`` of a ``case``. Not collective.

    A variant's own assignments come after ``overrides`` and win. With ``shortened`` the case's
    ``[test]`` table shortens all.

    Raises
    ------
    InputError
        If a scene is wrong, with the variant's name if there are several.
    """
    runs = whole_runs_of(read_draft(case, overrides, shortened), variants)
    for one in runs.refused:
        raise InputError(f"variant {one.variant.name}: {one.outcome}")
    return runs.jobs


def scene_of(draft: Draft, variant: Variant, several: bool) -> Scene:
    """The checked scene of a variant of a case. Not collective.

    Raises
    ------
    UnfitScene
        If its values do not fit together or are implausible.
    InputError
        If a value is out of bounds; it names the variant if that is one of ``several``.
    """
    _refuse_petsc(variant)
    try:
        scene = draft.with_words(_assigned(variant)).scene()
        return turned(scene) if variant.direction == BACKWARD else scene
    except UnfitScene:
        raise
    except InputError as error:
        if not several:
            raise
        raise InputError(f"variant {variant.name}: {error}") from error


T = TypeVar("T")


class Part(NamedTuple):
    """Every ``n_parts``-th run from the ``number``-th on, counted from 1."""

    number: int
    n_parts: int

    def of(self, jobs: Sequence[T]) -> list[T]:
        """Its runs, or pieces of work, among all of a sweep or study."""
        return list(jobs[self.number - 1 :: self.n_parts])

    @property
    def folder(self) -> str:
        """Name of the folder of its table."""
        return f"part_{self.number}_of_{self.n_parts}"


def parse_part(text: str) -> Part:
    """The part that ``--part`` names.

    Raises
    ------
    InputError
        If it is no I/N with 1 <= I <= N.
    """
    found = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text, re.ASCII)
    part = Part(*map(int, found.groups())) if found else Part(0, 0)
    if not 1 <= part.number <= part.n_parts:
        raise InputError(
            f"--part is {shown(text)}; it must be I/N with I from 1 to N, such as 3/10"
        )
    return part
