"""Whether laws and regulated lifts fit to their pantographs and to the run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.train.pantograph import LumpedTable

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def check_laws(scene: Scene) -> Iterator[Fault]:
    """Laws on masses that are not there, and what all bodies or slow samples do not allow."""
    for name, table in scene.pantographs.items():
        key = f"pantographs.{name}"
        lumped = isinstance(table, LumpedTable)
        n = len(table.masses_kg) if isinstance(table, LumpedTable) else 2
        for number, law in enumerate(table.laws):
            if law.at_mass is not None and law.at_mass > n:
                has = f"{n} masses" if lumped else "2, the head and the arm"
                yield refusal(
                    scene.origin,
                    f"{key}.laws.{number}.at_mass",
                    law.at_mass,
                    f"the pantograph has {has}",
                )
        whole = not isinstance(table, LumpedTable) and table.motion == "all_bodies"
        for part, given in (("laws", table.laws), ("regulation", table.regulation)):
            if whole and given:
                yield refusal(
                    scene.origin,
                    f"{key}.motion",
                    "all_bodies",
                    f"{key}.{part} acts on mechanisms that are reduced to tables only",
                )
        regulation = table.regulation
        if regulation is not None and regulation.sample_s < scene.numerics.dt_s:
            yield refusal(
                scene.origin,
                f"{key}.regulation.sample_s",
                regulation.sample_s,
                f"a sample takes at least a step, numerics.dt_s = {scene.numerics.dt_s:g}",
            )
