"""A part of the runs of a sweep or study, as a task of a job array makes it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import shown

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
