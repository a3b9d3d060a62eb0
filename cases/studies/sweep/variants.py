"""Variants of a case: names with assignments, and products of varied keys."""

from __future__ import annotations

import hashlib
import itertools
import json
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.scene.input.case_files import parse_assignment, read_toml
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.input.plain_text import steers
from catenary.cases.scene.keys.keys import known_keys, list_of, names_value, unknown_key
from catenary.postproc.files.csv_text import begins_formula

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

MAX_VARIANTS = 10_000
MOST_LETTERS = 200  # in a variant's name
_LONGEST_SLUG = 100  # bytes; folder names may have 255 bytes; room for what a user puts around them
VARY = "on the command line (--vary)"
_OPENING, _CLOSING, _QUOTES = "[{", "]}", "\"'"


@dataclass(frozen=True)
class Variant:
    """One way to change a case.

    Attributes
    ----------
    name : names the variant and its folder
    assignments : ``key=value`` each, applied to the case in this order
    varied : varied key -> the value's text, for tables and axes
    named : its name in a file of variants, if keys are varied too
    direction : of the train, whose scene is turned for the one backward; empty if none is chosen
    where : where the values of varied keys are written, for sentences
    """

    name: str
    assignments: tuple[str, ...]
    varied: Mapping[str, str] = field(default_factory=dict)
    named: str = ""
    direction: str = ""
    where: str = VARY


class VariedKey(NamedTuple):
    """A key and the texts of the values that it takes."""

    key: str
    values: tuple[str, ...]


def parse_vary(text: str) -> VariedKey:
    """Key and values of ``key=v1,v2,...``; commas inside brackets and quotes do not separate.

    Raises
    ------
    InputError
        If it has another form, or names a value twice or one that PETSc takes at its start.
    """
    key, equals, rest = text.partition("=")
    key = key.strip()
    values = tuple(split_values(rest))
    if not equals or not key or not all(values):
        raise InputError(
            f"--vary {shown(text)} must have the form key=value,value,..., e.g. "
            "train.speed_km_h=250,300"
        )
    return varied_key(key, values)


def whole_numbers(text: str, flag: str, least: int, most: int, example: str) -> list[int]:
    """Whole numbers of a ``text`` of the form ``a,b,...``, from ``least`` to ``most``, ascending.

    ``flag`` is the name of the command's option, ``example`` a right text, both for the sentence.

    Raises
    ------
    InputError
        If it has another form, or names one that is out of bounds, or one twice.
    """
    try:
        values = sorted(int(part) for part in text.split(","))
    except ValueError:
        values = []
    within = bool(values) and least <= values[0] and values[-1] <= most
    if not within or len(set(values)) < len(values):
        raise InputError(
            f"{flag} {shown(text)[1:-1]} must be whole numbers from {least} to {most}, each "
            f"once, as a,b,..., e.g. {example}"
        )
    return values


def varied_key(key: str, values: tuple[str, ...]) -> VariedKey:
    """A key and the texts of its values, at least one.

    Raises
    ------
    InputError
        If a value is named twice, or if PETSc takes the key at its start.
    """
    vary = option("--vary", "vary")
    if key.split(".")[0] == "petsc":
        raise InputError(
            f"{vary} {shown(key)[1:-1]} is not possible: PETSc takes its options once, when the "
            "program starts"
        )
    for text in (key, *values):
        if any(steers(letter) for letter in text):
            raise InputError(f"{vary} {shown(text)} holds a control character")
    first: dict[str | float, str] = {}
    for value in values:
        number = _number_of(value)
        if number in first:
            earlier, again = shown(first[number])[1:-1], shown(value)[1:-1]
            how = "twice" if again == earlier else f"after {earlier}, which is the same"
            raise InputError(f"{vary} {shown(key)[1:-1]} names {again} {how}")
        first[number] = value
    return VariedKey(key, values)


def _number_of(text: str) -> str | float:
    """The number that a text stands for, or the text."""
    try:
        return float(text)
    except ValueError:
        return text


def text_of(value: Any) -> str:
    """A value of TOML as the text of an assignment, which ``parse_assignment`` reads again."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(map(_quoted, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(k)} = {_quoted(v)}' for k, v in value.items())}}}"
    text = str(value)
    if isinstance(value, str) and parse_assignment(f"key={text}")[1] != value:
        return json.dumps(value)
    return text


def is_number(value: Any) -> bool:
    """Whether a value is a number, which true and false are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def check_key(key: str, where: str) -> None:
    """Raise InputError if no scene has a dotted key; ``where`` is the place in which it was
    written, for the sentence."""
    from catenary.cases.scene.scene import Scene

    known = known_keys(Scene)
    if not names_value(key, known):
        raise InputError(unknown_key(key, where, known))


def share_a_value(key: str, other: str) -> bool:
    """Whether two dotted keys are the same, or one of them stands within the other."""
    shorter, longer = sorted((_parts(key), _parts(other)), key=len)
    return longer[: len(shorter)] == shorter


def refuse_idle(key: str, scene: Scene, where: str) -> None:
    """Refuse to vary an irregularity of a scene whose effect is switched off.

    Parameters
    ----------
    key : dotted, of any kind
    scene : as it stands
    where : the place that names the key, with which the sentence begins

    Raises
    ------
    InputError
        If the effect is off, so that all values of the key are the same scene.
    """
    table, _, rest = key.partition(".")
    effect = rest.partition(".")[0]
    if table == "irregularities" and not scene.effects.get(effect, True):
        raise InputError(
            f"{where} would change nothing: effects.{effect} "
            f"{scene.origin.of(f'effects.{effect}')} is false"
        )


def sets_again(later: str, earlier: str) -> bool:
    """Whether nothing is left of the value of a dotted key when a later one is set."""
    return share_a_value(earlier, later) and later.count(".") <= earlier.count(".")


def _parts(key: str) -> list[str]:
    """The parts of a dotted key, numbers of entries without zeros in front."""
    return [str(int(part)) if part.isdecimal() else part for part in key.split(".")]


def _quoted(value: Any) -> str:
    """Text of a value within a list or a table, where texts stand in quotes."""
    return json.dumps(value) if isinstance(value, str) else text_of(value)


def split_values(text: str) -> list[str]:
    """The values of ``v1,v2,...``: ``text`` cut at commas outside of brackets and quotes."""
    parts, depth, quote, start = [], 0, "", 0
    for place, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in _QUOTES:
            quote = letter
        elif letter in _OPENING:
            depth += 1
        elif letter in _CLOSING:
            depth -= 1
        elif letter == "," and depth == 0:
            parts.append(text[start:place].strip())
            start = place + 1
    return [*parts, text[start:].strip()]


def product(
    varied: Sequence[VariedKey], named: Mapping[str, Sequence[str]], where: str = VARY
) -> list[Variant]:
    """All combinations of the varied keys' values, each under every named variant.

    The last key varies fastest. Without named variants the keys alone make the variants.

    Raises
    ------
    InputError
        If a key is varied twice, or a later one sets it again, or there are too many combinations.
    """
    keys, vary = [each.key for each in varied], option("--vary", "vary")
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{vary} {key} is given twice; name all its values in one {vary}")
    for earlier, later in itertools.combinations(keys, 2):
        if sets_again(later, earlier):
            raise InputError(
                f"{vary} {later} sets {earlier} again, so that the values of the latter would be "
                f"lost; name {later} first"
            )
    for (name, assignments), key in itertools.product(named.items(), keys):
        for given in (text.partition("=")[0].strip() for text in assignments):
            if sets_again(key, given):
                raise InputError(
                    f"{vary} {key} sets the {given} of variant {shown(name)[1:-1]} again, so that "
                    "the latter would be lost; leave one of them out"
                )
    count = max(len(named), 1)
    for each in varied:
        count *= len(each.values)
    if count > MAX_VARIANTS:
        raise InputError(f"these variations make {count} runs; at most {MAX_VARIANTS} are allowed")
    last = [key[list_of(key).rfind(".") + 1 :] for key in keys]
    # The last part of each key, with the number of an entry; the whole key where two share it.
    labels = [name if last.count(name) == 1 else key for key, name in zip(keys, last, strict=True)]
    variants = []
    for name, assignments in (named or {"": ()}).items():
        for values in itertools.product(*(each.values for each in varied)):
            chosen = dict(zip(keys, values, strict=True))
            words = [name] if name else []
            words += [f"{label}_{value}" for label, value in zip(labels, values, strict=True)]
            own = tuple(f"{key}={value}" for key, value in chosen.items())
            of_file = name if chosen else ""
            parts = "__".join(words), (*assignments, *own), chosen
            variants.append(Variant(*parts, named=of_file, where=where))
    return _with_own_folders(variants)


def slug(text: str) -> str:
    """``text`` as the name of a folder: letters and digits of any script, ``.``, ``_`` and ``-``.

    Letters are those of NFC, in which one with an accent is one character. What is too long is cut
    and marked with a digest of the whole.
    """
    text = unicodedata.normalize("NFC", text)
    kept = "".join(one if one in "._" or _is_of_words(one) else "-" for one in text)
    name = re.sub("-+", "-", kept).strip("-.") or "variant"
    if len(name.encode()) > _LONGEST_SLUG:
        mark = hashlib.sha256(text.encode()).hexdigest()[:8]
        # Cut between two characters, which have several bytes each in other scripts.
        name = f"{name.encode()[: _LONGEST_SLUG - 9].decode(errors='ignore')}-{mark}"
    return name


def _is_of_words(letter: str) -> bool:
    """Whether a character is a letter, a mark on one (vowels of Indian scripts), or a digit."""
    return unicodedata.category(letter)[0] in "LMN"


def _with_own_folders(variants: list[Variant]) -> list[Variant]:
    """The variants under names that are folders, no two the same."""
    taken: set[str] = set()
    result = []
    for variant in variants:
        name = slug(variant.name)
        number = 2
        while name.casefold() in taken:  # some file systems ignore case
            name = f"{slug(variant.name)}-{number}"
            number += 1
        taken.add(name.casefold())
        result.append(replace(variant, name=name))
    return result


def read_named(path: Path) -> dict[str, list[str]]:
    """Named variants of a TOML file: a table of name = ["key=value", ...].

    Raises
    ------
    InputError
        If the file is something else.
    """
    table: dict[str, Any] = read_toml(path)
    if not table:
        raise InputError(f'{path} names no variant; a line of it is: name = ["key=value", ...]')
    for name, assignments in table.items():
        odd = begins_formula(name) or any(steers(letter) for letter in name)
        if odd or not 0 < len(name) <= MOST_LETTERS:
            raise InputError(
                f"{shown(name)} in {path} cannot name a variant: a name has 1 to {MOST_LETTERS} "
                "characters, none of them a control character, and begins with none of = + - @"
            )
        if not isinstance(assignments, list) or not all(isinstance(a, str) for a in assignments):
            raise InputError(
                f'{shown(name)[1:-1]} in {path} must be a list of assignments: ["key=value", ...]'
            )
    return table


def check_keys(variants: Sequence[Variant], where: str) -> None:
    """Raise InputError if an assignment of a variant has an unknown key; ``where`` as of
    ``check_key``."""
    for variant in variants:
        for assignment in variant.assignments:
            check_key(parse_assignment(assignment, f"variant {variant.name}:")[0], where)
