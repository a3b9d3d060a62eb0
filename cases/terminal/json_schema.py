"""The JSON schema of a scene, by which editors complete and check ``case.toml``."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from catenary.cases.scene.keys.table import OneOrMore
from catenary.cases.scene.keys.units import unit_of
from catenary.cases.scene.scene import Scene
from catenary.solver.effects import all_effects as effects


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
