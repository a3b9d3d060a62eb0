"""Reading the file of a study over a set of scenes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from catenary.cases.scene.input.faults import Origin, SceneError, text_faults
from catenary.cases.scene.input.toml_input import read_toml
from catenary.cases.scene.keys.error_sentences import schema_faults
from catenary.cases.scene.keys.table import Table

OwnTable = TypeVar("OwnTable", bound=Table)


def read_task(task: Path | Mapping[str, Any], model: type[OwnTable]) -> OwnTable:
    """The checked content of a task: a TOML file, or its nested tables.

    Raises
    ------
    InputError
        If the file cannot be read, or with all faults of its keys.
    """
    if isinstance(task, Mapping):
        raw, origin = dict(task), Origin("the table of the task")
    else:
        raw, origin = read_toml(task), Origin(str(task))
    faults, more = text_faults(raw, origin), 0
    try:
        table = model.model_validate(raw)
    except ValidationError as failed:
        of_schema, more = schema_faults(failed, raw, model, origin)
        faults += of_schema
    if faults:
        raise SceneError(faults, more)
    return table
