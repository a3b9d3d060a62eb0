"""What is told of many runs: each remark once, with the runs that it is of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

# More runs than this are not named one by one if a remark is of them all.
_NAMED = 4


def remark_lines(runs: Iterable[tuple[str, Sequence[str]]]) -> list[str]:
    """Lines for below a table, none if there are no remarks. Not collective.

    Parameters
    ----------
    runs : the name of each run, and its remarks
    """
    told = list(runs)
    names: dict[str, list[str]] = {}
    for name, remarks in told:
        for text in dict.fromkeys(remarks):
            names.setdefault(text, []).append(name)
    return [f"REMARK      {_of(own, len(told))}: {text}" for text, own in names.items()]


def _of(names: Sequence[str], n_runs: int) -> str:
    if len(names) == n_runs > _NAMED:
        return f"all {n_runs} runs"
    return ", ".join(names)
