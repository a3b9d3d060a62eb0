"""Lists of ``catenary list``: cases, keys, their JSON schema, pantographs, rule books, criteria."""

from __future__ import annotations

import difflib
import fnmatch
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pydantic import BaseModel, TypeAdapter
from pydantic.fields import FieldInfo
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import PydanticUndefined, core_schema

from catenary.base.errors import InputError
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.scene.keys.keys import ANY, kind_of, tables_in
from catenary.cases.scene.keys.table import OneOrMore
from catenary.cases.scene.keys.units import USUAL, Usual, unit_of, usual_range
from catenary.cases.scene.scene import Scene
from catenary.mbs.lumped import READY, ReadyPantograph
from catenary.meshgen.topologies.all_topologies import registered
from catenary.postproc.evaluate.wording import terminal_width
from catenary.postproc.standards.rule_books import (
    DEFAULT,
    QUANTITIES,
    SYSTEMS,
    Rule,
    RuleBook,
    book_named,
    editions_of,
    shipped,
)
from catenary.solver.effects import all_effects as effects

# Words that a check takes, where the key's type is plain text.
_WORDS = {
    "evaluation.edition": list(editions_of(DEFAULT)),
    "evaluation.rules": list(shipped()),
    "evaluation.system": list(SYSTEMS),
}
_GLOB = "*?["
# Bounds of a JSON schema.
_BOUNDS = (
    ("minimum", "from"),
    ("exclusiveMinimum", "above"),
    ("maximum", "to"),
    ("exclusiveMaximum", "to below"),
)


@dataclass(frozen=True)
class Key:
    """A key: its field, and which kinds of a table have it (none for all)."""

    name: str
    default: str
    meaning: str
    field: FieldInfo | None = None
    kinds: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """Unit in brackets, "" where the key has none."""
        unit = unit_of(self.name)
        return f"[{unit}]" if unit else ""


def case_table(titles: Mapping[str, str]) -> str:
    """Names and titles of cases, one line each."""
    width = max(map(len, titles), default=0)
    return "\n".join(f"{name:{width}}  {title}" for name, title in titles.items())


def keys_of_a_scene() -> list[Key]:
    """All keys of a scene, in the order of its tables."""
    return _keys_in(Scene, "")


def _keys_in(model: type[BaseModel], prefix: str) -> list[Key]:
    found = []
    for name, field in model.model_fields.items():
        key = f"{prefix}{name}"
        inner, wildcard = tables_in(field.annotation)
        if key == "effects":
            found += [
                Key(f"effects.{effect.name}", str(effect.default).lower(), effect.title)
                for effect in effects.registry().values()
            ]
        elif inner:
            below = f"{key}.{ANY}." if wildcard else f"{key}."
            found += _keys_in(inner[0], below) if len(inner) == 1 else _of_kinds(inner, below)
        else:
            found.append(Key(key, _default(field), field.description or "", field))
    return found


def _of_kinds(tables: Sequence[type[BaseModel]], prefix: str) -> list[Key]:
    """Keys of a table of which there are kinds: those that only some have name these."""
    kinds = [kind_of(table) for table in tables]
    owners: dict[tuple[str, ...], tuple[Key, list[str]]] = {}
    for table, kind in zip(tables, kinds, strict=True):
        for key in _keys_in(table, prefix):
            if key.name != f"{prefix}type":
                same = (key.name, key.default, key.meaning)
                owners.setdefault(same, (key, []))[1].append(kind)
    found = [Key(f"{prefix}type", "-", f"one of {', '.join(kinds)}")]
    for key, having in owners.values():
        nested = "." in key.name[len(prefix) :]
        some = () if nested or having == kinds else tuple(having)
        found.append(replace(key, kinds=some or key.kinds))
    return found


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    if field.default is PydanticUndefined:
        return "empty"
    text = "-" if field.default in (None, "") else str(field.default)
    return text.lower() if isinstance(field.default, bool) else text


def key_table() -> str:
    """Every key of a scene: name, unit, default, meaning; one line each, and on a terminal the
    meaning below, which is wider than that."""
    rows, is_shown = [], terminal_width() is not None
    for key in keys_of_a_scene():
        meaning = key.meaning + (f" ({', '.join(key.kinds)})" if key.kinds else "")
        about = f"{key.name:52} {key.unit:8} {key.default:12}"
        rows += [about.rstrip(), *_folded(meaning)] if is_shown else [f"{about} {meaning}"]
    return "\n".join(rows)


def key_details(wanted: str) -> str:
    """Details of the keys that a filter leaves, several lines each.

    ``wanted`` is a part of a key, or a pattern for all of it with ``*``, ``?`` and ``[...]``; if no
    key has that part, a part of a meaning.

    Raises
    ------
    InputError
        If nothing is left.
    """
    return "\n".join(_details(key) for key in _chosen(wanted))


def _chosen(wanted: str) -> list[Key]:
    every, low = keys_of_a_scene(), wanted.strip().lower()
    whole = [key for key in every if key.name.lower() == low]
    if whole:
        return whole
    if any(letter in low for letter in _GLOB):
        found = [key for key in every if fnmatch.fnmatchcase(key.name.lower(), low)]
    else:
        found = [key for key in every if low in key.name.lower()]
        found = found or [key for key in every if low in key.meaning.lower()]
    if found and low:
        return found
    parts = {part for key in every for part in key.name.split(".") if part != ANY}
    near = difflib.get_close_matches(low, sorted(parts), n=1)
    hint = f"did you mean {near[0]}?" if near else "`catenary list --keys` names all"
    raise InputError(f'no key of a scene fits "{plain(wanted, 80)}"; {hint}')


def _details(key: Key) -> str:
    head = f"{key.name} {key.unit}".rstrip()
    default = {"required": "required", "-": "may be left out", "empty": "may be left out"}
    only = f"only of {', '.join(key.kinds)}" if key.kinds else ""
    facts = [default.get(key.default, f"default {key.default}"), allowed(key), only]
    lines = [key.meaning, "; ".join(filter(None, facts))]
    if typical := USUAL.get(key.name, Usual()).words:
        lines.append(f"typical: {typical}")
    elif usual := usual_range(key.name):
        lines.append(f"usual: {usual[0]:.12g} to {usual[1]:.12g}")
    lines += _about_effect(key.name)
    return "\n".join([head, *(part for line in lines for part in _folded(line))])


def _about_effect(name: str) -> list[str]:
    """Sentences on an effect's additions, requirements, data and source; none for other keys."""
    effect = effects.registry().get(name.removeprefix("effects."))
    if effect is None or not name.startswith("effects."):
        return []
    required = ", ".join(f"effects.{other}" for other in effect.requires)
    return [
        f"adds {effect.adds}",
        f"requires {required}" if required else "",
        f"acts only with {effect.data}" if effect.data else "",
        f"source: {effect.source}",
    ]


def words_of(key: Key) -> list[str]:
    """The words that a key accepts, none if it takes anything else."""
    return _words_in(_schema_of(key))


def allowed(key: Key) -> str:
    """Bounds and words that a key accepts."""
    return _of_schema(_schema_of(key))


def _schema_of(key: Key) -> dict[str, Any]:
    """The JSON schema of a key."""
    if key.name in _WORDS:
        return {"enum": _WORDS[key.name]}
    if key.field is None:
        return {"type": "boolean"} if key.name.startswith("effects.") else {}
    return TypeAdapter(key.field.rebuild_annotation()).json_schema()


def _words_in(schema: dict[str, Any]) -> list[str]:
    if "anyOf" in schema:
        return [word for one in schema["anyOf"] for word in _words_in(one)]
    if schema.get("type") == "boolean":
        return ["true", "false"]
    only = [schema["const"]] if "const" in schema else []
    return [str(word) for word in schema.get("enum", only)]


def _of_schema(schema: dict[str, Any]) -> str:
    """Allowed values of a JSON schema in words."""
    if "anyOf" in schema:
        options = [_of_schema(one) for one in schema["anyOf"] if one.get("type") != "null"]
        return " or ".join(dict.fromkeys(text for text in options if text))
    if words := _words_in(schema):
        return "true or false" if words == ["true", "false"] else f"one of {', '.join(words)}"
    kind = schema.get("type")
    if kind in ("number", "integer"):
        noun = "whole number" if kind == "integer" else "number"
        bounds = [f"{word} {schema[name]:.12g}" for name, word in _BOUNDS if name in schema]
        return " ".join([noun, *bounds])
    if kind == "array":
        return _list(schema)
    return {"string": "text", "object": "table"}.get(str(kind), "")


def _list(schema: dict[str, Any]) -> str:
    least, most = schema.get("minItems"), schema.get("maxItems")
    if least is not None and least == most:
        count = f"list of {least}"
    elif most is not None:
        count = f"list of {least or 0} to {most}"
    else:
        count = "list"
    entries = _of_schema(schema.get("items", {}))
    return f"{count}, each {entries}" if entries else count


_WIDTH = 96


def book_table() -> str:
    """All shipped books: what chooses each, its title, how many criteria it has."""
    default, rows = book_named(DEFAULT).key, []
    for key, book in shipped().items():
        note = " (where a scene names none)" if key == default else ""
        noun = "criterion" if len(book.criteria) == 1 else "criteria"
        rows.append(f"{key:18} {len(book.criteria):2} {noun:9} {book.title}{note}")
    return "\n".join(rows)


def criteria_text(name: str) -> str:
    """The criteria of a book with their limits and clauses.

    Raises
    ------
    InputError
        If there is no such book.
    """
    try:
        book = book_named(name)
    except InputError as unknown:
        raise InputError(f'"{plain(name, 80)}": {unknown}') from None
    lines = [f"{book.key}: {book.title}", *_folded(f"source: {' '.join(book.source.split())}")]
    for rule in book.criteria:
        lines += ["", *_about(book, rule)]
    return "\n".join(lines)


def _about(book: RuleBook, rule: Rule) -> list[str]:
    quantity = QUANTITIES[rule.quantity]
    of = f" (each {quantity.per})" if rule.per_pantograph else ""
    lines = [f"{rule.id}: {rule.title}"]
    lines += _folded(f"{rule.quantity}{of}: {quantity.meaning} [{quantity.unit}]")
    lines += _folded(f"limit {rule.words()}")
    lines += _folded(f"clause: {rule.clause}; {comparison(book, rule)}")
    return lines + (_folded(f"note: {rule.note}") if rule.note else [])


def comparison(book: RuleBook, rule: Rule) -> str:
    """Whether a limit was compared with the text of the standard."""
    if book.is_compared(rule):
        return "compared with the text"
    return "not compared with the text of the standard"


def _folded(text: str) -> list[str]:
    return textwrap.wrap(text, _width(), initial_indent="    ", subsequent_indent="      ")


def _width() -> int:
    """Columns of folded text, those of a narrower terminal."""
    return min(_WIDTH, terminal_width() or _WIDTH)


def scene_schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of ``case.toml``. Not collective.

    Returns
    -------
    dict
        Types, bounds, words, defaults and meanings of all keys; a meaning ends with the unit of its
        key in brackets. Checks that need several keys at once are no part of it: see
        ``catenary check``.
    """
    schema = Scene.model_json_schema(schema_generator=_AsWritten)
    # Words that messages list themselves: fields of any text, which checks look at.
    schema["$defs"]["LineTable"]["properties"]["topology"]["enum"] = list(registered())
    schema["$defs"]["EvaluationTable"]["properties"]["system"]["enum"] = list(SYSTEMS)
    schema["$schema"] = GenerateJsonSchema.schema_dialect
    schema["title"] = "case.toml of Catenary"
    for table in (schema, *schema["$defs"].values()):
        for name, key in table.get("properties", {}).items():
            key.pop("title", None)
            if unit := unit_of(name):
                key["description"] = f"{key.get('description', '')} [{unit}]".strip()
    schema["properties"]["effects"] |= {
        "additionalProperties": False,
        "properties": {
            name: {"type": "boolean", "default": effect.default, "description": effect.title}
            for name, effect in effects.registry().items()
        },
    }
    lumped = schema["$defs"]["LumpedTable"]  # a ready chain stands for the lists
    lists = set(lumped["required"]) & {"masses_kg", "stiffnesses_N_per_m", "dampings_N_s_per_m"}
    lumped["required"] = [name for name in lumped["required"] if name not in lists]
    lumped["anyOf"] = [{"required": ["model"]}, {"required": sorted(lists)}]
    return schema


class _AsWritten(GenerateJsonSchema):
    """Schemas of what a person writes, where a check before turns that into something else."""

    def function_before_schema(
        self, schema: core_schema.BeforeValidatorFunctionSchema
    ) -> dict[str, Any]:
        """One number or a list where a list is meant, and a year where a text is."""
        made = super().function_before_schema(schema)
        function = schema["function"]["function"]
        if function is OneOrMore.func:
            return {"anyOf": [made["items"], made]}
        if function.__name__ == "_year":
            return {"anyOf": [{"type": "integer"}, made]}
        return made


def pantograph_table() -> str:
    """Name, chain, forces and source of each ready pantograph, a few lines each."""
    lines = []
    for name, ready in READY.items():
        chain = ready.chain
        lines += [
            name,
            f"  {_numbers(chain.masses)} kg, head first; {_numbers(chain.stiffnesses)} N/m and "
            f"{_numbers(chain.dampings)} N s/m below",
            f"  {_force(ready)}",
            f"  {ready.source}",
        ]
    return "\n".join(lines)


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _signed(value: float) -> str:
    return f" {'-' if value < 0 else '+'} {abs(value):g}"


def _force(ready: ReadyPantograph) -> str:
    if ready.static_force is None:
        return "no force of its own: static_force_N or static_force_by_speed is needed"
    text = f"{ready.static_force:g} N"
    if any(ready.uplift):
        a, b, c = ready.uplift
        terms = f"{a:g} v^2{_signed(b)} v{_signed(c)} N"
        text += f" + {terms} for v in km/h, never below {ready.static_force:g} N"
    return text
