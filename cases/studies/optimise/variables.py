"""Variables of an optimisation: changes of keys of a scene, entry by entry of their lists."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.scene.input.toml_input import value_at
from catenary.cases.scene.problem import resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.optimise.task import VariableTable
from catenary.cases.studies.sweep.variants import check_key, is_number, share_a_value

# Keys whose entries are places along a span: of two that are symmetric one moves against the other.
_PLACES = "positions_m"
# Finite differences take this share of the width of the bounds.
_USUAL_STEP = 0.02


class Component(NamedTuple):
    """One number that a search chooses: by how much some entries change.

    Attributes
    ----------
    key : dotted key
    entries : numbers of the entries of its list, from 0; none of a single number
    signs : of each entry's change, 1 or -1
    low, high : bounds of the change, in the key's unit
    step : of finite differences, in the key's unit
    round_to : the unit of its changes, 0 for any
    """

    key: str
    entries: tuple[int, ...]
    signs: tuple[int, ...]
    low: float
    high: float
    step: float
    round_to: float

    @property
    def name(self) -> str:
        """Key and numbers of entries, from 1."""
        if not self.entries:
            return self.key
        return f"{self.key} {', '.join(str(entry + 1) for entry in self.entries)}"


@dataclass(frozen=True)
class Variables:
    """All components, and the values of their keys as the case has them.

    A change of all is an array, shape (n,), each component in the unit of its key.
    """

    components: Sequence[Component]
    shipped: dict[str, Any]

    @property
    def low(self) -> np.ndarray:
        """Lower bounds of the change, shape (n,)."""
        return np.array([one.low for one in self.components])

    @property
    def high(self) -> np.ndarray:
        """Upper bounds of the change, shape (n,)."""
        return np.array([one.high for one in self.components])

    @property
    def steps(self) -> np.ndarray:
        """Steps of finite differences, shape (n,)."""
        return np.array([one.step for one in self.components])

    def values(self, change: np.ndarray) -> dict[str, Any]:
        """Values by dotted keys after a change, shape (n,)."""
        found = {
            key: list(value) if isinstance(value, list) else value
            for key, value in self.shipped.items()
        }
        for one, by in zip(self.components, change.tolist(), strict=True):
            if not one.entries:
                found[one.key] += by
            for entry, sign in zip(one.entries, one.signs, strict=True):
                found[one.key][entry] += sign * by
        return found

    def rounded(self, change: np.ndarray) -> np.ndarray:
        """The change with each component a whole multiple of its unit, within bounds."""
        found = change.copy()
        for i, one in enumerate(self.components):
            if one.round_to:
                # Whole units from the case's value, so that a change can be measured off.
                least, most = np.ceil(one.low / one.round_to), np.floor(one.high / one.round_to)
                found[i] = one.round_to * np.clip(np.round(change[i] / one.round_to), least, most)
        return found


def variables_of(tables: Sequence[VariableTable], scene: Scene) -> Variables:
    """The variables of a task for a case.

    Raises
    ------
    InputError
        If a key has no number or list of numbers in the scene, or is varied twice, or if its
        entries are not there, or its value is out of its bounds.
    """
    components: list[Component] = []
    shipped: dict[str, Any] = {}
    tables_of_scene = resolved(scene)
    for number, table in enumerate(tables):
        where = f"variables.{number}.key"
        for other in shipped:
            if share_a_value(table.key, other):
                by = "" if table.key == other else f", also by {other}"
                raise InputError(f"{where} is {table.key}, which is varied twice{by}; name it once")
        value = _value(tables_of_scene, table.key, where)
        shipped[table.key] = value
        entries = _classes(table, len(value), number) if isinstance(value, list) else [()]
        for own in entries:
            components.append(_component(table, own, value, number))
    return Variables(components, shipped)


def _value(tables: dict[str, Any], key: str, where: str) -> Any:
    check_key(key, f"in {where}")
    found = value_at(tables, key)
    numbers = found if isinstance(found, list) and found else [found]
    if not all(is_number(one) for one in numbers):
        raise InputError(
            f"{where} is {key}, which has no number or list of numbers in the scene; give it there "
            f"first, e.g. by {option('--set', 'replace()')}"
        )
    return [float(one) for one in found] if isinstance(found, list) else float(found)


def _classes(table: VariableTable, n: int, number: int) -> list[tuple[int, ...]]:
    """Entries that change alike, numbers from 0."""
    if table.entries == "free":
        return [(i,) for i in range(n)]
    if table.entries == "together":
        return [tuple(range(n))]
    if table.entries == "symmetric":
        pairs: list[tuple[int, ...]] = [(i, n - 1 - i) for i in range(n // 2)]
        is_place = table.key.endswith(_PLACES)  # the one in the middle stays there
        return pairs if is_place or n % 2 == 0 else [*pairs, (n // 2,)]
    given = [entry for own in table.entries for entry in own]
    if len(set(given)) < len(given) or max(given) > n:
        raise InputError(
            f"variables.{number}.entries must name each entry of {table.key} once at most, from 1 "
            f"to {n}"
        )
    return [tuple(entry - 1 for entry in own) for own in table.entries]


def _component(
    table: VariableTable, entries: tuple[int, ...], value: Any, number: int
) -> Component:
    mirrored = table.key.endswith(_PLACES) and table.entries == "symmetric"
    signs = (1, -1) if mirrored else (1,) * len(entries)
    if table.change is not None:
        low, high = table.change
    else:
        assert table.bounds is not None
        own = np.array([value[entry] for entry in entries] if entries else [value])
        least, most = table.bounds
        outside = own[(own < least) | (own > most)]
        if outside.size:
            raise InputError(
                f"variables.{number}.bounds are {least:g} and {most:g}, but {table.key} has "
                f"{outside[0]:g} in the case, where the search begins"
            )
        up = np.array(signs or (1,)) > 0
        low = -float(np.where(up, own - least, most - own).min())
        high = float(np.where(up, most - own, own - least).min())
        if high <= low:
            raise InputError(f"variables.{number}.bounds leave {table.key} no change")
    if table.round_to is not None and table.round_to > max(-low, high):
        raise InputError(
            f"variables.{number}.round_to is {table.round_to:g}, but {table.key} may change by "
            f"{max(-low, high):g} at most, so that 0 is its only multiple left"
        )
    step = table.step or _USUAL_STEP * (high - low)
    if step > 0.5 * (high - low):  # so that one fits, up or down, wherever a search is
        raise InputError(
            f"variables.{number}.step is {step:g}, but the bounds of {table.key} are "
            f"{high - low:g} apart: it may be half of that at most"
        )
    return Component(table.key, entries, signs, low, high, step, table.round_to or 0.0)
