"""Words of a command line: several keys after one ``--vary``, options in a wrong place."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from typer.core import TyperCommand

VARY = "--vary"
# Options of PETSc, whose first letter would be taken for an option of the verb, the rest for its
# value: -options_view for -o.
_OF_PETSC = re.compile(r"-(?!o)[a-z]+(_[a-z]+)+|-(options|on_error)_[a-z]+")


class Verb(TyperCommand):
    """A verb; if it has ``--vary``, words directly after that one's value may be varied, too."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take the words of a command line apart. Not collective."""
        for word in args[: args.index("--")] if "--" in args else args:
            if _OF_PETSC.fullmatch(word):
                ctx.fail(f"{word} is no option of {self.name}: those of PETSc stand after --")
            if word.partition("=")[0] == "--set" and self._is_of_a_run():
                ctx.fail(
                    "the keys of a run stay as it recorded them: --set belongs to `catenary run`, "
                    "with another folder for the new results"
                )
        if any(VARY in one.opts for one in self.params):
            args = each_varied(args)
        return super().parse_args(ctx, args)

    def _is_of_a_run(self) -> bool:
        """Whether the verb takes the folder of a run in place of a case."""
        return any(one.metavar == "FOLDER" for one in self.params)  # type: ignore[attr-defined]


def each_varied(words: Sequence[str]) -> list[str]:
    """The words of a command line with ``--vary`` before each key that takes several values.

    Words belong to the option that stands before them. Of those of ``--vary`` a word with a single
    value stays a further assignment, as without ``--vary`` before it.
    """
    found: list[str] = []
    is_value = follows = False
    for number, word in enumerate(words):
        if is_value:  # of --vary, whatever it is
            is_value, follows = False, True
        elif word == "--":  # behind it stand options for PETSc
            return [*found, *words[number:]]
        elif word.startswith("-"):
            is_value, follows = word == VARY, word.startswith(f"{VARY}=")
        elif follows and _has_several_values(word):
            found.append(VARY)
        found.append(word)
    return found


def _has_several_values(word: str) -> bool:
    if "=" not in word or "," not in word:
        return False
    from catenary.cases.studies.sweep.variants import split_values

    return len(split_values(word.partition("=")[2])) > 1
