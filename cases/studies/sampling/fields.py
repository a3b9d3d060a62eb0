"""Fields along the line: keys of a scene that take a value for each dropper, support or span."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.scene.line.line_data import span_lengths, staggered
from catenary.cases.scene.problem import line_of
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.sampling.design import normal_rows
from catenary.cases.studies.sampling.distributions import inverse
from catenary.cases.studies.sampling.tables import ChanceField, FieldTable
from catenary.cases.studies.sweep.variants import text_of
from catenary.meshgen.line import Line

# Correlated values of more places take minutes to make; so many numbers take about 1 GB as text.
_MOST_CORRELATED, _MOST_NUMBERS = 5_000, 50_000_000
# Samples whose fields are made at a time.
_BATCH = 1000

# Keys that place droppers, supports and spans.
_GEOMETRY = (
    "line.n_spans",
    "line.span_m",
    "line.spans_file",
    "line.topology",
    "line.transition",
    "line.overlap",
    "line.links",
    "line.dropper.positions_m",
    "line.dropper.count",
    "line.dropper.spacing_m",
    "line.dropper.patterns",
    "line.dropper.patterns_file",
)


class Carrier(NamedTuple):
    """Form in which a key of the scene takes a field.

    Attributes
    ----------
    places : shape (n,), where the values stand along the line [m]
    own : shape (n,), the scene's own values, to which the field is added, in the key's unit
    text : from values of shape (n,) to the key's value as text
    """

    places: np.ndarray
    own: np.ndarray
    text: Callable[[np.ndarray], str]


def fields_as_text(
    key: str,
    table: FieldTable,
    scene: Scene,
    varied: Sequence[str],
    seed: int,
    realisations: Sequence[int],
    where: str,
) -> list[str]:
    """The values of a key that takes a field, one for each realisation, as texts of TOML.

    Parameters
    ----------
    key : of the scene
    table : distribution and correlation along the line
    scene : whose line it is
    varied : keys that vary too
    seed : of the sampling
    realisations : numbers of the realisations; the same number gives the same field
    where : place of the field's table, for sentences

    Raises
    ------
    InputError
        If the key takes no field, if a varied key moves its places, or if it has too many of them.
    """
    make = _CARRIERS.get(key)
    if make is None:
        raise InputError(f"fields.{key} {where} takes no field; there are {', '.join(_CARRIERS)}")
    moving = [one for one in varied if any(f"{one}.".startswith(f"{g}.") for g in _GEOMETRY)]
    if moving:
        raise InputError(
            f"fields.{key} {where} cannot stand beside {moving[0]}, which moves the places of its "
            "values; vary one of the two"
        )
    if (key == "defects") != isinstance(table, ChanceField):
        raise InputError(f'fields.{key} {where} cannot be of type {table.type}; "chance" is for '
                         "defects, and for them alone")  # fmt: skip
    if table.at is not None and not key.endswith(".by_place"):
        raise InputError(f"fields.{key}.at {where} is for courses along the line (by_place) only")
    carrier = make(scene, line_of(scene), table)
    n = len(carrier.places)
    if n == 0:
        raise InputError(f"fields.{key} {where} has no places: the line has no droppers")
    if n * len(realisations) > _MOST_NUMBERS:
        raise InputError(
            f"fields.{key} {where} needs {len(realisations)} samples of {n} values; at most "
            f"{_MOST_NUMBERS} values are allowed"
        )
    factor = _factor(key, table, carrier.places, where)
    texts: list[str] = []
    for begin in range(0, len(realisations), _BATCH):
        normal = normal_rows(seed, key, realisations[begin : begin + _BATCH], n)
        if factor is not None:
            normal = normal @ factor.T
        texts += map(carrier.text, carrier.own + _values(key, table, normal, where))
    return texts


def correlation(table: FieldTable, places: np.ndarray) -> np.ndarray:
    """Correlation of the normal quantities behind a field, shape (n, n).

    Parameters
    ----------
    table : with a correlation length above 0
    places : shape (n,) [m]
    """
    distance = np.abs(places[:, None] - places) / table.correlation_length_m
    return np.asarray(np.exp(-distance if table.correlation == "exponential" else -(distance**2)))


def _factor(key: str, table: FieldTable, places: np.ndarray, where: str) -> np.ndarray | None:
    """A factor F with F F^T the correlation, None for independent values."""
    if not table.correlation_length_m:
        return None
    if len(places) > _MOST_CORRELATED:
        raise InputError(
            f"fields.{key} {where} correlates {len(places)} values; at most {_MOST_CORRELATED} "
            "are allowed"
        )
    # A Gaussian correlation is singular to rounding: eigenvalues below that are zero.
    values, vectors = np.linalg.eigh(correlation(table, places))
    return np.asarray(vectors * np.sqrt(np.clip(values, 0.0, None)))


def _values(key: str, table: FieldTable, normal: np.ndarray, where: str) -> np.ndarray:
    from scipy.special import ndtr, ndtri

    if isinstance(table, ChanceField):
        return np.asarray(normal < ndtri(table.probability), float)
    if table.type == "normal":  # at once: through probabilities digits are lost
        return np.asarray((table.mean or 0.0) + table.standard_deviation * normal)
    try:
        return np.asarray(inverse(table, 0.0)(ndtr(normal)))
    except ValueError as error:
        raise InputError(f"fields.{key} {where} {error}") from error


def _dropper_lengths(scene: Scene, line: Line, table: FieldTable) -> Carrier:
    which = line.numbered_droppers
    own = np.zeros(len(which))
    given = scene.irregularities.dropper_lengths
    number = {place: i for i, place in enumerate(which)}
    for span, dropper, error in (given.by_dropper if given is not None else None) or ():
        own[number[int(span), int(dropper)]] += error
    template = ", ".join(f"[{span}, {dropper}, %.4f]" for span, dropper in which)
    return Carrier(np.array([*which.values()]), own, _filled(f"[{template}]"))


def _heights(name: str, usual: str) -> Callable[[Scene, Line, FieldTable], Carrier]:
    """Carrier of heights [m] by place, at supports or droppers."""

    def carrier(scene: Scene, line: Line, table: FieldTable) -> Carrier:
        given = getattr(scene.irregularities, name)
        if given is not None and given.by_place is not None:
            raise InputError(
                f"irregularities.{name}.by_place {scene.origin.of(f'irregularities.{name}')} "
                "cannot stand beside a field of the same key; take one of them away"
            )
        at_supports = (table.at or usual) == "supports"
        places = line.support_positions if at_supports else np.unique(line.dropper_x)
        template = ", ".join(f"[{x:.6f}, %.7f]" for x in places)
        return Carrier(places, np.zeros(len(places)), _filled(f"[{template}]"))

    return carrier


def _staggers(name: str) -> Callable[[Scene, Line, FieldTable], Carrier]:
    """Carrier of sideways offsets at the supports [m]."""

    def carrier(scene: Scene, line: Line, table: FieldTable) -> Carrier:
        own = np.array(staggered(getattr(scene.line, name) or [0.0], scene.line.n_spans))
        return Carrier(line.support_positions, own, _filled(_list_of(len(own))))

    return carrier


def _spans(scene: Scene, line: Line, table: FieldTable) -> Carrier:
    if scene.line.transition.span_m is not None:
        raise InputError(
            "fields.line.span_m needs one list of all spans; take line.transition.span_m away"
        )
    own, masts = np.array(span_lengths(scene.line)), line.support_positions
    return Carrier(0.5 * (masts[1:] + masts[:-1]), own, _filled(_list_of(len(own))))


def _defects(scene: Scene, line: Line, table: FieldTable) -> Carrier:
    assert isinstance(table, ChanceField)
    which, kind = line.numbered_droppers, table.defect
    own = [text_of(one.model_dump(exclude_none=True)) for one in scene.defects]
    spared = {
        (getattr(one, "span", 0), getattr(one, "dropper", 0)) for one in scene.defects
    }  # a dropper has one defect

    entries = [
        "" if one in spared else text_of({"type": kind, "span": one[0], "dropper": one[1]})
        for one in which
    ]

    def text(values: np.ndarray) -> str:
        found = (entries[i] for i in np.flatnonzero(values))
        return f"[{', '.join([*own, *filter(None, found)])}]"

    return Carrier(np.array([*which.values()]), np.zeros(len(which)), text)


def _filled(template: str) -> Callable[[np.ndarray], str]:
    """Values put into a text with a place for each."""
    return lambda values: template % tuple(values.tolist())


def _list_of(n: int) -> str:
    return f"[{', '.join(['%.7f'] * n)}]"


_CARRIERS: dict[str, Callable[[Scene, Line, FieldTable], Carrier]] = {
    "irregularities.dropper_lengths.by_dropper": _dropper_lengths,
    "irregularities.contact_wire_height.by_place": _heights("contact_wire_height", "supports"),
    "irregularities.running_surface.by_place": _heights("running_surface", "droppers"),
    "line.stagger_m": _staggers("stagger_m"),
    "line.messenger_stagger_m": _staggers("messenger_stagger_m"),
    "line.span_m": _spans,
    "defects": _defects,
}
