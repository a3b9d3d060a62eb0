"""A sweep whose variants leave whole runs, and what a folder of one already holds.

Two sweeps are of one scene if the records of both have its tables.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.errors import InputError
from catenary.base.files import is_file
from catenary.cases.result_folder.output_folder import (
    another_folder,
    force_option,
    refuse_impossible,
)
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.load import Draft
from catenary.cases.studies.sweep.jobs import (
    Ended,
    Job,
    RunOptions,
    in_order,
    jobs_and_refused,
)
from catenary.cases.studies.sweep.variants import Variant

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene
    from catenary.cases.studies.sweep.jobs import Part

RECORD = "sweep.json"
# Tables that no figure of a variant depends on.
_IDLE = ("case", "output", "test")


def other_value(
    one: Mapping[str, Any], two: Mapping[str, Any], varied: Sequence[str]
) -> tuple[str, Any, Any] | None:
    """The first value in which two scenes differ and on which figures may depend: its key and both
    values. None if they do not differ.

    Parameters
    ----------
    one, two : tables of the scenes, as records of sweeps have them
    varied : keys that variants set, so that it does not matter what the scenes have there
    """
    for key, here, there in differences(one, two):
        sets = any(f"{key}.".startswith(f"{own}.") for own in varied)
        # Files may stand in other folders of other machines.
        elsewhere = key.endswith("file") and Path(str(here)).name == Path(str(there)).name
        if key.split(".")[0] not in _IDLE and not sets and not elsewhere:
            return key, here, there
    return None


def differences(one: Any, two: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Keys of tables, and of lists of one length, with the values in which they differ."""
    pairs: list[tuple[str, Any, Any]]
    if isinstance(one, Mapping) and isinstance(two, Mapping):
        pairs = [(name, one.get(name), two.get(name)) for name in dict.fromkeys([*one, *two])]
    elif isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        pairs = [(str(i), a, b) for i, (a, b) in enumerate(zip(one, two, strict=True))]
    else:
        if one != two:
            yield key, one, two
        return
    for name, a, b in pairs:
        yield from differences(a, b, f"{key}.{name}" if key else name)


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

    def run(
        self, out: Path, comm: Any, options: RunOptions, part: Part | None = None
    ) -> list[Ended]:
        """Run what is not done yet; returns how all variants ended, in their order. Collective.

        With a ``part`` only its variants are run and returned, without the refused ones.
        """
        from catenary.cases.studies.sweep.run_jobs import run_jobs

        if part is not None:
            return run_jobs(part.of(self.jobs), out, comm, options)
        return in_order(self.variants, run_jobs(self.jobs, out, comm, options), self.refused)


def whole_runs_of(
    draft: Draft,
    variants: Sequence[Variant],
    out: Path,
    *,
    full_report: bool = False,
    force: bool = False,
) -> WholeRuns:
    """A sweep of ``variants`` of a case, ``draft``, into a folder ``out`` where they leave whole
    runs, with ``full_report`` a report of each. Not collective.

    Raises
    ------
    InputError
        As ``jobs_and_refused``, or if the folder has the table of a sweep with variants that this
        one has not, and ``force`` is not given.
    """
    runs = WholeRuns(draft, variants, *jobs_and_refused(draft, variants, full_report))
    refuse_other_sweep(out, variants, force)
    return runs


def refuse_other_sweep(
    out: Path, variants: Sequence[Variant], force: bool, draft: Draft | None = None
) -> None:
    """Raise InputError if ``out`` has a table of another sweep, unless ``force``: of variants that
    this one has not, or that have other values here, or of another scene than that of ``draft``.

    Folders of whole runs are compared with the ``draft`` of each when it is their turn.
    """
    refuse_impossible(out)
    path = out / RECORD
    if force or not is_file(path):
        return
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        there = {str(one["name"]): list(one["assignments"]) for one in table["variants"]}
        scene, varied = table.get("scene") or {}, [str(key) for key in table["varied"]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return
    here = {variant.name: list(variant.assignments) for variant in variants}
    replace = f"{another_folder()}, or give {force_option()} to replace it"
    if other := sorted(there.keys() - here.keys()):
        raise InputError(
            f"{path} is the table of a sweep with other variants ({other[0]}); {replace}"
        )
    if other := sorted(name for name, values in there.items() if values != here[name]):
        raise InputError(f"{path} is the table of a sweep with another {other[0]}; {replace}")
    if draft is None or not scene:
        return
    own = json.loads(json.dumps(draft.table(), default=str))
    if (differs := other_value(scene, own, varied)) is not None:
        key, value, wanted = differs
        raise InputError(
            f"{path} is the table of a sweep with {key} = {shown(value)}, here it is "
            f"{shown(wanted)}; {replace}"
        )
