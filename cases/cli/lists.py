"""The verb ``list``."""

from __future__ import annotations

from typing import Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli import completion
from catenary.cases.cli.app import app
from catenary.cases.terminal import console


@app.command(
    "list",
    help="List cases, keys, pantographs, rule books or the schema.",
    epilog="Example: catenary list --keys damping",
)
@console.guarded
@console.serial
def list_cases(
    keys: Annotated[
        bool, typer.Option("--keys", help="Every key of a scene, its unit, default and meaning.")
    ] = False,
    pantographs: Annotated[
        bool,
        typer.Option("--pantographs", help="Ready pantographs, for pantographs.NAME.model."),
    ] = False,
    schema: Annotated[
        bool,
        typer.Option(
            "--schema", help="The JSON schema of case.toml, for editors that complete keys."
        ),
    ] = False,
    rules: Annotated[
        bool,
        typer.Option("--rules", help="Rule books that judge a run, for evaluation.rules."),
    ] = False,
    wanted: Annotated[
        str | None,
        typer.Argument(
            metavar="FILTER",
            autocompletion=completion.keys,
            help="With --keys: a part of a key, or a pattern with * and ?; prints bounds, accepted "
            "words and typical values too. With --rules: a book, whose criteria and limits are "
            "printed.",
        ),
    ] = None,
) -> None:
    """Serial."""
    given = [
        name
        for name, on in (
            ("--keys", keys),
            ("--pantographs", pantographs),
            ("--rules", rules),
            ("--schema", schema),
        )
        if on
    ]
    if len(given) > 1:
        raise InputError(
            "list takes one of --keys, --pantographs, --rules and --schema, not "
            f"{' and '.join(given)}"
        )
    if rules:
        from catenary.cases.terminal.rule_list import book_table, criteria_text

        console.say(book_table() if wanted is None else criteria_text(wanted))
        return
    if keys:
        from catenary.cases.terminal.key_list import key_details, key_table

        console.say(key_table() if wanted is None else key_details(wanted))
        return
    if wanted is not None:
        raise InputError(f"{wanted} filters keys: write `catenary list --keys {wanted}`")
    if schema:
        import json

        from catenary.cases.terminal.json_schema import scene_schema

        console.say(json.dumps(scene_schema(), indent=1))
        return
    if pantographs:
        from catenary.cases.terminal.terminal_text import pantograph_table

        console.say(pantograph_table())
        return
    from catenary.cases.scene.input.case_files import entries
    from catenary.cases.terminal import terminal_text

    console.say(terminal_text.case_table(entries()))
