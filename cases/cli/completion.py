"""Completion in a shell: names of shipped cases, keys after ``--set``, words that a key takes.

Called at every press of the tabulator key: nothing here imports more than a
list does, and an error only means that nothing is completed.
"""

from __future__ import annotations


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
