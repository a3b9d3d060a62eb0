"""Samples as variants of a case: assignments of the values that a sampling file says.

A design has points of the unit cube, whose coordinates have the wanted rank correlation. Fields are
along the line: keys of a scene that take a value for each dropper, support or span.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import value_at
from catenary.cases.scene.input.csv_files import file_key_of
from catenary.cases.scene.keys.keys import list_of
from catenary.cases.scene.line.line_data import span_lengths, staggered
from catenary.cases.scene.scene import Scene, line_of, resolved
from catenary.cases.studies.sweep.variants import (
    Variant,
    is_number,
    refuse_idle,
    share_a_value,
    text_of,
)
from catenary.cases.studies.uncertainty.sampling import (
    SALTELLI,
    ChanceField,
    ChoicesTable,
    DistributionTable,
    FieldTable,
    SamplingTable,
    SeedTable,
    chosen,
    field_column,
    inverse,
    seeds,
    takes_mean,
)
from catenary.meshgen.line import Line

# No coordinate is nearer to 0 or 1: a normal quantity stays within 7 standard deviations.
_EDGE = 1e-12
# Correlated values of more places take minutes to make; so many numbers take about 1 GB as text.
_MOST_CORRELATED, _MOST_NUMBERS = 5_000, 50_000_000
# Samples whose fields are made at a time.
_BATCH = 1000


def samples(sampling: SamplingTable, scene: Scene, file: str) -> list[Variant]:
    """The variants of a sampling, in the order of its design. Not collective.

    Parameters
    ----------
    sampling : the checked sampling file
    scene : the scene that is varied, for values and places of its own
    file : where the sampling was written, for sentences

    Raises
    ------
    InputError
        If a key has no value of its own that stands for a missing mean, or takes no field, or if a
        key sets another one again or changes nothing.
    """
    cube = _points(sampling)
    where = f"in {file}"
    own = resolved(scene)
    _refuse_lost(sampling, own, where)
    if not any(key.startswith("effects.") for key in sampling.keys):
        for key in (*sampling.keys, *sampling.fields):
            refuse_idle(key, scene, f"{key} {where}")
    columns: dict[str, list[str]] = {}  # of the table
    assigned: list[list[str]] = []  # a list of assignments for each key of the scene
    lists: dict[str, dict[int, list[str]]] = {}  # entries that vary, by the keys of their lists
    for key, table, column in zip(
        sampling.keys, sampling.keys.values(), cube.T[: len(sampling.keys)], strict=True
    ):
        texts = _texts(key, table, column, own, where)
        columns[key] = texts
        above = list_of(key)
        if above == key or not _is_plain_list(value_at(own, above)):
            assigned.append([f"{key}={text}" for text in texts])
        else:
            lists.setdefault(above, {})[int(key.rpartition(".")[2])] = texts
    for key in (*lists, *sampling.fields):
        if named := file_key_of(key, scene.origin):  # its numbers are part of the samples' own
            assigned.append([f"{named}="] * len(cube))
            if key == "line.span_m":  # the file may say how many there are
                assigned.append([f"line.n_spans={scene.line.n_spans}"] * len(cube))
    for key, entries in lists.items():
        assigned.append(_assigned_lists(key, value_at(own, key), entries, len(cube), where))
    for key, field, column in zip(
        sampling.fields, sampling.fields.values(), cube.T[len(sampling.keys) :], strict=True
    ):
        numbers = seeds(column)
        varied = (*sampling.keys, *(other for other in sampling.fields if other != key))
        texts = _fields_as_text(key, field, scene, varied, sampling.seed, numbers, where)
        columns[field_column(key)] = [str(number) for number in numbers]
        assigned.append([f"{key}={text}" for text in texts])
    names = list(columns)
    return [
        Variant(
            sample_name(number), assignments, dict(zip(names, values, strict=True)), where=where
        )
        for number, (assignments, values) in enumerate(
            zip(zip(*assigned, strict=True), zip(*columns.values(), strict=True), strict=True), 1
        )
    ]


def sample_name(number: int) -> str:
    """The variant of a sample, by its number from 1: the same, however many samples there are."""
    return f"sample_{number:06d}"


def _refuse_lost(sampling: SamplingTable, own: dict[str, Any], where: str) -> None:
    """Refuse a key whose value another one sets again, in a scene with the tables ``own``."""
    keys = [*sampling.keys, *sampling.fields]
    for number, later in enumerate(keys):
        for earlier in keys[:number]:
            if not share_a_value(earlier, later):
                continue
            # A part may be set after its table; an entry is set together with its list.
            is_part = later.count(".") > earlier.count(".") and not _is_plain_list(
                value_at(own, earlier)
            )
            if not is_part:
                raise InputError(
                    f"{later} {where} sets the value of {earlier} again, so that one of both would "
                    "be lost; keep one of them"
                )


def _texts(
    key: str, table: DistributionTable, column: np.ndarray, own: dict[str, Any], where: str
) -> list[str]:
    """The values of a key as texts of TOML, from probabilities."""
    if isinstance(table, SeedTable):
        return [str(number) for number in seeds(column)]
    if isinstance(table, ChoicesTable):
        texts = [text_of(value) for value in table.values]
        return [texts[number] for number in chosen(table, column)]
    try:
        mean = _own_number(key, own) if takes_mean(table) else None
        values = inverse(table, mean)(column)
    except ValueError as error:
        raise InputError(f"keys.{key} {where} {error}") from error
    return [repr(value) for value in values.tolist()]


def _assigned_lists(
    key: str, own: list[Any], entries: dict[int, list[str]], n: int, where: str
) -> list[str]:
    """Assignments of a list some entries of which vary; the others are the scene's own."""
    if max(entries) >= len(own):
        raise InputError(
            f"keys.{key}.{max(entries)} {where} is unknown: the list has {len(own)} entries, "
            "numbered from 0"
        )
    texts = [entries.get(i, [text_of(value)] * n) for i, value in enumerate(own)]
    return [f"{key}=[{', '.join(one)}]" for one in zip(*texts, strict=True)]


def _is_plain_list(value: Any) -> bool:
    """Whether a value is a list of numbers or texts."""
    return isinstance(value, list) and not any(isinstance(one, dict | list) for one in value)


def _own_number(key: str, own: dict[str, Any]) -> float:
    """The scene's own value of a dotted key; ValueError if it has none, with a predicate."""
    here = value_at(own, key)
    if isinstance(here, list) and len(here) == 1:  # one number may be written for a list
        (here,) = here
    if not is_number(here):
        raise ValueError("needs a mean: the scene has no number of its own there")
    return float(here)


def _points(sampling: SamplingTable) -> np.ndarray:
    """Points of the open unit cube, one a sample, (n_samples, n_columns), uniform and with the
    wanted correlation.

    Sobol points are scrambled (Owen 1998); with them, and with random ones, a larger ``n`` begins
    with the same points. Samples of ``saltelli`` stand in the order of SALib: a base sample, those
    in which one coordinate is another's, the other base sample.
    """
    from scipy.stats import qmc

    n, d, seed = sampling.n, len(sampling.columns), sampling.seed
    if sampling.method == SALTELLI:
        from SALib.sample import sobol

        found = sobol.sample(
            salib_problem(sampling.columns), n, calc_second_order=sampling.second_order, seed=seed
        )
    elif sampling.method == "sobol":
        # A power of 2 keeps the balance of the sequence, and its first points are the same.
        found = qmc.Sobol(d, seed=seed).random_base2(math.ceil(math.log2(n)))[:n]
    elif sampling.method == "latin_hypercube":
        found = qmc.LatinHypercube(d, seed=seed).random(n)
    else:
        found = np.random.default_rng(seed).random((n, d))
    found = np.clip(found, _EDGE, 1.0 - _EDGE)
    return _correlated(found, sampling) if sampling.correlations else found


def salib_problem(columns: Sequence[str]) -> dict[str, object]:
    """Inputs as SALib takes them, uniform in the unit cube."""
    bounds = [[0.0, 1.0] for _ in columns]
    return {"num_vars": len(columns), "names": list(columns), "bounds": bounds}


def _correlated(uniform: np.ndarray, sampling: SamplingTable) -> np.ndarray:
    """Coordinates under a Gaussian copula.

    Normal quantities with the correlation r have the rank correlation rho = 6/pi asin(r/2)
    (Kruskal 1958, J. Am. Stat. Assoc. 53, eq. 6.3), so that r = 2 sin(pi rho/6).
    """
    from scipy.special import ndtr, ndtri

    matrix = np.eye(uniform.shape[1])
    columns = sampling.columns
    for one in sampling.correlations:
        i, j = (columns.index(key) for key in one.keys)
        matrix[i, j] = matrix[j, i] = 2.0 * math.sin(math.pi * one.rank / 6.0)
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError as error:
        raise InputError(
            "the correlations of the sampling contradict each other: no quantities have all of "
            "them (their matrix is not positive definite)"
        ) from error
    return np.clip(ndtr(ndtri(uniform) @ factor.T), _EDGE, 1.0 - _EDGE)


def _normal_rows(seed: int, name: str, realisations: Sequence[int], n: int) -> np.ndarray:
    """Independent standard normal numbers, a row of ``n`` for each realisation.

    A row depends on the sampling's seed, the field's name and the number of the realisation only,
    so that the same one always comes again.
    """
    # A counter-based generator (Salmon et al. 2011) is set to a key in no time.
    philox = np.random.Philox(key=0)
    generator, state = np.random.Generator(philox), philox.state
    mark = zlib.crc32(name.encode())
    rows = np.empty((len(realisations), n))
    for row, number in zip(rows, realisations, strict=True):
        state["state"]["key"][:] = (seed << 32 | mark, number)
        philox.state = state
        generator.standard_normal(out=row)
    return rows


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


def _fields_as_text(
    key: str,
    table: FieldTable,
    scene: Scene,
    varied: Sequence[str],
    seed: int,
    realisations: Sequence[int],
    where: str,
) -> list[str]:
    """The values of a key that takes a field, one for each realisation, as texts of TOML. Keys that
    are ``varied`` too must not move its places; ``where`` says where the field's table stands."""
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
        normal = _normal_rows(seed, key, realisations[begin : begin + _BATCH], n)
        if factor is not None:
            normal = normal @ factor.T
        texts += map(carrier.text, carrier.own + _values(key, table, normal, where))
    return texts


def _correlation(table: FieldTable, places: np.ndarray) -> np.ndarray:
    """Correlation (n, n) of the normal quantities behind a field at ``places`` (n,) [m], of a table
    with a correlation length above 0."""
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
    values, vectors = np.linalg.eigh(_correlation(table, places))
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
        return Carrier(line.support_positions, own, _filled(_list_template(len(own))))

    return carrier


def _spans(scene: Scene, line: Line, table: FieldTable) -> Carrier:
    if scene.line.transition.span_m is not None:
        raise InputError(
            "fields.line.span_m needs one list of all spans; take line.transition.span_m away"
        )
    own, masts = np.array(span_lengths(scene.line)), line.support_positions
    return Carrier(0.5 * (masts[1:] + masts[:-1]), own, _filled(_list_template(len(own))))


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


def _list_template(n: int) -> str:
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
