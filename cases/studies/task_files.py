"""Files of studies: their tables of TOML, read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.input.faults import Origin, text_faults
from catenary.cases.scene.input.plain_text import refuse_deep
from catenary.cases.scene.keys.keys import known_keys, schema_faults

Model = TypeVar("Model", bound=BaseModel)
_OF_SCENES = "; see `catenary list --keys` for all keys"


def read_task(task: Path | Mapping[str, Any], model: type[Model]) -> Model:
    """The checked content of a task: a TOML file, or its nested tables.

    Raises
    ------
    InputError
        If the file cannot be read, or as ``checked_table``.
    """
    if isinstance(task, Mapping):
        return checked_table(task, model, "the table of the task")
    return checked_table(read_toml(task), model, str(task))


def checked_table(raw: Mapping[str, Any], model: type[Model], file: str) -> Model:
    """Nested tables as a model has them; ``file`` is where they were written, for sentences.

    Raises
    ------
    InputError
        One sentence about the first fault, and how many there are more.
    """
    tables, origin = dict(raw), Origin(file)
    refuse_deep(tables, file)
    faults, more = text_faults(tables, origin), 0
    try:
        table = model.model_validate(tables)
    except ValidationError as failed:
        of_schema, more = schema_faults(failed, tables, model, origin)
        known = {fault.key for fault in faults}
        faults += [fault for fault in of_schema if fault.key not in known]
    if not faults:
        return table
    first = faults[0].sentence.removeprefix("the scene in ")  # of no key: of the file
    if first.endswith(_OF_SCENES):
        parts = ("*" if part.isdigit() else part for part in faults[0].key.split(".")[:-1])
        above = "".join(f"{part}." for part in parts)
        keys = (key.removeprefix(above) for key in known_keys(model) if key.startswith(above))
        takes = ", ".join(key for key in keys if "." not in key)
        first = first.removesuffix(_OF_SCENES) + (f"; it takes {takes}" if takes else "")
    more += len(faults) - 1
    raise InputError(first + (f" (and {more} more)" if more else ""))
