"""Words of a command line: completed by a shell, several keys after ``--vary``, misplaced options.

A shell completes names of shipped cases, keys after ``--set`` and words that a key takes. That is
called at every press of the tabulator key: nothing here imports more than a list does, and an error
only means that nothing is completed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from typer.core import TyperCommand

VARY = "--vary"
# Options of PETSc, whose first letter would be taken for an option of the verb, the rest for its
# value: -options_view for -o.
_OF_PETSC = re.compile(r"-(?!o)[a-z]+(_[a-z]+)+|-(options|on_error)_[a-z]+")


def cases(incomplete: str) -> list[tuple[str, str]]:
    """Names of shipped cases with their titles; shells complete paths themselves."""
    from catenary.cases.scene.input.case_files import titles

    return [(name, title) for name, title in titles().items() if name.startswith(incomplete)]


def beginnings(incomplete: str) -> list[tuple[str, str]]:
    """Kinds of line that a new case may begin with."""
    from catenary.cases.scene.starter import BEGINNINGS

    return [(name, one.meaning) for name, one in BEGINNINGS.items() if name.startswith(incomplete)]


def assignments(incomplete: str) -> list[tuple[str, str]]:
    """``key=`` for all keys that fit, or ``key=word`` once the key is whole.

    Keys below what a scene names itself, such as its kinds of pantograph, are left out.
    """
    from catenary.cases.scene.keys.keys import ANY
    from catenary.cases.terminal.lists import keys_of_a_scene, words_of

    name, equals, begun = incomplete.partition("=")
    every = [key for key in keys_of_a_scene() if ANY not in key.name.split(".")]
    if not equals:
        return [(f"{key.name}=", key.meaning) for key in every if key.name.startswith(name)]
    chosen = next((key for key in every if key.name == name), None)
    words = [] if chosen is None else words_of(chosen)
    return [(f"{name}={word}", "") for word in words if word.startswith(begun)]


def keys(incomplete: str) -> list[tuple[str, str]]:
    """All keys of a scene, for the filter of ``list --keys``."""
    from catenary.cases.terminal.lists import keys_of_a_scene

    return [(key.name, key.meaning) for key in keys_of_a_scene() if key.name.startswith(incomplete)]


def axes(incomplete: str) -> list[tuple[str, str]]:
    """Axes of ``accuracy``, the last one of a list with commas."""
    from catenary.cases.studies.accuracy.axes import AXES

    before, comma, begun = incomplete.rpartition(",")
    taken = before.split(",")
    return [
        (f"{before}{comma}{name}", axis.title)
        for name, axis in AXES.items()
        if name.startswith(begun) and name not in taken
    ]


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
