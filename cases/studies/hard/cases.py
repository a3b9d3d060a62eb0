"""The collection of hard cases: what each is, what a right answer is, and its scenes.

The table ``hard/hard.toml`` holds them; a case that is not in it is not run. Each is a variant of a
shipped case. Limits in the table are the answer's own (what may be pressed, lifted, lost); limits
that follow from round-off and from the methods stand in `hard/checks.py`.
"""

from __future__ import annotations

import difflib
import fnmatch
from functools import cache
from itertools import chain, product
from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from catenary.base.errors import InputError
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.task_files import read_task

TABLE = Path(__file__).resolve().with_name("hard.toml")
# The correction's own tolerances, far below what is compared: where wires move along the track,
# and where undamped droppers chatter, what it leaves in a step grows ten thousandfold in a run.
_CORRECTION = (
    "numerics.scheme=fixed_point",
    "numerics.eps_d_m=1e-13",
    "numerics.eps_v_m_per_s=1e-10",
    "numerics.max_iterations=400",
)


class Needs(Table):
    """Events that must occur in a run for it to be the hard case that it is named after."""

    switches: int = Field(0, ge=0, description="droppers that slacken or tighten, summed")
    passes: int = Field(
        0, ge=0, description="times the greater part of the force passes to another contact wire"
    )
    stopped: int = Field(0, ge=0, description="steps in which an arm presses on its uplift stop")
    lost_m: float = Field(0, ge=0, description="longest way without contact, regained after it")
    lost_share_below: float | None = Field(
        None, gt=0, description="share of the steps without contact in the later half of the run"
    )
    on_nodes: int = Field(0, ge=0, description="steps that end exactly on a node of the wire")
    crossing: bool = Field(
        False, description="a dropper switches in the step that crosses the boundary of two ranks"
    )
    touches_after_s: float = Field(0, ge=0, description="first contact not before this time")
    breaks: int = Field(0, ge=0, description="droppers that carry up to an incident, never after")
    breaks_at_cut: bool = Field(
        False, description="one of them stands within an element of the boundary of two ranks"
    )
    energy_leaves: float | None = Field(
        None, gt=0, description="most by which the energy that leaves differs from theory, relative"
    )
    no_force_after_s: float | None = Field(
        None, ge=0, description="no pantograph touches the wire after this time"
    )
    ends_at_m: float | None = Field(None, description="place where the run ends")


class HardCase(Table):
    """A hard case.

    ``kind`` "train" marches a train; "free" lets the line go from under a force, without train.
    """

    name: str = Field(min_length=1, description="its name")
    what: str = Field(min_length=1, description="what is hard about it")
    right: str = Field(min_length=1, description="what a right answer is")
    kind: Literal["train", "free"] = Field("train", description="what moves")
    set: list[str] = Field(
        default_factory=list, description="assignments, as after --set, or names of sets and lines"
    )
    short: list[str] = Field(default_factory=list, description="further ones of the short form")
    force_below_N: float = Field(1e3, gt=0, description="no contact force is greater")
    uplift_below_m: float = Field(0.3, gt=0, description="no contact lifts the wire by more")
    refined: bool = Field(True, description="whether halved steps converge within the run")
    same: float = Field(
        1e-4,
        gt=0,
        description="differences of head heights between steps and halved ones that need not fall "
        "any further, of their deviation",
    )
    fixed_point: Literal["agrees", "breaks", "left out"] = Field(
        "agrees", description="what the paper's correction does, if it is run"
    )
    energy_gain: float = Field(
        1e-9, gt=0, description="most that the line's energy may gain beyond the work done on it, "
        "of its largest value"
    )  # fmt: skip
    schemes_m: float = Field(
        1e-7, gt=0, description="most by which head heights of the two schemes differ"
    )
    ranks: float = Field(
        1e-9, gt=0, description="most by which forces of one and of several ranks differ, relative"
    )
    ranks_m: float | None = Field(
        None, gt=0, description="in place of that where impacts let round-off decide forces: most "
        "by which head heights differ"
    )  # fmt: skip
    steps: int = Field(0, ge=0, description="kind free: steps")
    short_steps: int = Field(0, ge=0, description="kind free: steps of the short form")
    needs: Needs = Field(default_factory=Needs, description="what must happen in it")

    @model_validator(mode="after")
    def _has_steps(self) -> HardCase:
        if (self.kind == "free") != (self.steps > 0 and self.short_steps > 0):
            raise ValueError("needs steps and short_steps if its kind is free, and only then")
        return self

    def scene(self, short: bool = False, halvings: int = 0, fixed_point: bool = False) -> Scene:
        """Its scene, in the ``short`` form, with the step halved ``halvings`` times, or with the
        paper's ``fixed_point`` correction."""
        table = collection()
        words = [*table.common, *table.assignments(self.set), *(self.short if short else [])]
        words += _CORRECTION if fixed_point else ()
        scene = load_scene(table.base, words)
        if halvings:
            dt = scene.numerics.dt_s / 2**halvings
            scene = load_scene(table.base, [*words, f"numerics.dt_s={dt!r}"])
        return scene


class HardLine(Table):
    """A line under which each of the conditions is a case, ``LINE_CONDITION``."""

    name: str = Field(min_length=1, description="its name")
    what: str = Field(min_length=1, description="what it is")
    set: list[str] = Field(description="assignments that make it")
    without: list[str] = Field(
        default_factory=list, description="conditions that mean nothing on it"
    )


class Collection(Table):
    """The whole table."""

    base: str = Field(description="the shipped case that all are variants of")
    common: list[str] = Field(description="assignments of all")
    sets: dict[str, list[str]] = Field(
        default_factory=dict, description="assignments that several cases have, by their name"
    )
    cases: list[HardCase] = Field(min_length=1, description="the cases")
    lines: list[HardLine] = Field(default_factory=list, description="lines of other kinds")
    conditions: list[HardCase] = Field(
        default_factory=list, description="what each of these lines is put under"
    )

    def assignments(self, words: list[str], within: tuple[str, ...] = ()) -> list[str]:
        """Assignments of words that are such, or names of sets or lines, ``within`` such ones.

        Raises
        ------
        InputError
            If a set or line names itself, directly or by others.
        """
        named = {line.name: line.set for line in self.lines} | self.sets
        if again := [word for word in words if word in within]:
            chain_of_names = " > ".join([*within[within.index(again[0]) :], again[0]])
            raise InputError(
                f"{TABLE} has a set of assignments that names itself ({chain_of_names}): take a "
                "name out of one of them"
            )
        parts = (
            self.assignments(named[word], (*within, word)) if word in named else [word]
            for word in words
        )
        return [*chain(*parts)]

    def all_cases(self) -> list[HardCase]:
        """The cases, and each line under each condition unless a case has that name."""
        found = {case.name: case for case in self.cases}
        for line, condition in product(self.lines, self.conditions):
            name = f"{line.name}_{condition.name}"
            if condition.name not in line.without and name not in found:
                what, words = f"{line.what}: {condition.what}", [*line.set, *condition.set]
                own = {"name": name, "what": what, "set": words}
                found[name] = condition.model_copy(update=own)
        return list(found.values())


@cache
def collection() -> Collection:
    """The table of hard cases.

    Raises
    ------
    InputError
        If the table is wrong.
    """
    found = read_task(TABLE, Collection)
    for entries in (found.cases, found.lines, found.conditions):
        if len({one.name for one in entries}) < len(entries):
            raise InputError(f"{TABLE} has two entries of one name")
    found.assignments([*found.sets, *(line.name for line in found.lines)])
    return found


def hard_cases(names: list[str] | None = None) -> list[HardCase]:
    """All hard cases, or those named, also by patterns with ``*`` and ``?``.

    Raises
    ------
    InputError
        If a name or pattern fits none.
    """
    cases = {case.name: case for case in collection().all_cases()}
    wanted: dict[str, HardCase] = {}
    for name in names or cases:
        found = fnmatch.filter(cases, name)
        if not found:
            near = difflib.get_close_matches(name, cases, n=3)
            hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(cases)}"
            raise InputError(f'there is no hard case "{name}"; {hint}')
        wanted |= {one: cases[one] for one in found}
    return list(wanted.values())
