"""Pages that are made from the program: keys of a scene, their JSON schema, verbs, rule books."""

from __future__ import annotations

import itertools
import json
from typing import Any

import typer
from mkdocs.structure.files import File, Files

from catenary.cases.cli.main import app
from catenary.cases.terminal.lists import Key, allowed, comparison, keys_of_a_scene, scene_schema
from catenary.postproc.standards.rule_books import LIMIT_KEYS, QUANTITIES, shipped

_KEYS = """# Keys of a scene

All keys of `case.toml`, made from the schema that checks it. `*` stands for a number of a list or
for a name that the scene chooses. `catenary list --keys FILTER` prints typical values too.

Editors complete and check `case.toml` by the [JSON schema](case.schema.json):
see [complete keys in an editor](../guide/scene_files.md#complete-keys-in-an-editor).
"""
_VERBS = """# Command line

All verbs and their options, made from the program. Every verb has `--help`.
[Results](../guide/results.md)
explains output and exit codes. `-q` silences everything but errors.
"""
_RULES = """# Rule books

All shipped [rule books](../guide/rules.md), made from their files in `postproc/standards/books`.
v is the speed of the train in km/h. The first limit whose condition holds is the one that counts.
"""


def on_files(files: Files, config: Any) -> Files:
    """The files of the site with those made here; called by MkDocs."""
    schema = json.dumps(scene_schema(), indent=1)
    for name, text in (
        ("reference/keys.md", keys_page()),
        ("reference/command_line.md", verbs_page()),
        ("reference/rules.md", rules_page()),
        ("reference/case.schema.json", schema),
    ):
        files.append(File.generated(config, name, content=text))
    return files


def keys_page() -> str:
    """A section for each table of a scene, a row for each key."""
    parts = [_KEYS]
    for table, keys in itertools.groupby(keys_of_a_scene(), lambda key: key.name.partition(".")[0]):
        parts += [
            f"\n## {table}\n",
            "| key | unit | default | allowed | meaning |",
            "|---|---|---|---|---|",
        ]
        parts += map(_row, keys)
    return "\n".join(parts) + "\n"


def _row(key: Key) -> str:
    only = f" (only of {', '.join(key.kinds)})" if key.kinds else ""
    cells = (f"`{key.name}`", key.unit.strip("[]"), key.default, allowed(key), key.meaning + only)
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def rules_page() -> str:
    """A section for each rule book with its criteria, and tables of quantities and of keys."""
    parts = [_RULES]
    for key, book in shipped().items():
        parts += [f"\n## {key}\n", f"{book.title}. {' '.join(book.source.split())}\n"]
        parts += ["| criterion | quantity | limit | clause | |", "|---|---|---|---|---|"]
        for rule in book.criteria:
            clause = f"{rule.clause}; {rule.note}" if rule.note else rule.clause
            cells = rule.title, f"`{rule.quantity}`", rule.words(), clause, comparison(book, rule)
            parts.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    parts += ["\n## Quantities\n", "| quantity | unit | of each | meaning |", "|---|---|---|---|"]
    parts += [f"| `{name}` | {q.unit} | {q.per} | {q.meaning} |" for name, q in QUANTITIES.items()]
    parts += ["\n## Limits of the line\n", "| key of evaluation.limits | unit | meaning |"]
    parts += ["|---|---|---|"]
    parts += [f"| `{name}` | {key.unit} | {key.meaning} |" for name, key in LIMIT_KEYS.items()]
    return "\n".join(parts) + "\n"


def verbs_page() -> str:
    """A section for each verb with its usage, options and example."""
    group: Any = typer.main.get_command(app)
    parts = [_VERBS]
    for name, verb in group.commands.items():
        with verb.make_context(name, ["--help"], resilient_parsing=True) as context:
            context.info_name = f"catenary {name}"
            usage = verb.get_usage(context).removeprefix("Usage: ")
            records = [one.get_help_record(context) for one in verb.get_params(context)]
        parts += [f"\n## catenary {name}\n", verb.help, f"\n```text\n{usage}\n```\n"]
        parts += ["| argument or option | meaning |", "|---|---|"]
        parts += [
            f"| `{names}` | {text} |".replace("||", "|") for names, text in filter(None, records)
        ]
        examples = (verb.epilog or "").removeprefix("Example: ").split("; ")
        parts += [
            "\nExample:" if len(examples) == 1 else "\nExamples:",
            "\n```text",
            *examples,
            "```",
        ]
    return "\n".join(parts) + "\n"
