"""Whether line, train, evaluation and effects fit together, beyond types and bounds.

Every check yields a ``Fault`` for each thing that is wrong: its sentence names the key, its value,
what is allowed and where the key was written. A check that needs what another one found wrong is
left out; all others go on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.checks import (
    defects,
    effects,
    free,
    line_tables,
    mesh_size,
    numerics,
    pantographs,
)
from catenary.cases.scene.input.faults import Fault, Origin, SceneError, UnfitScene
from catenary.cases.scene.keys.keys import is_known, known_keys, unknown_key
from catenary.cases.scene.keys.units import USUAL, unit_guess, unit_of
from catenary.cases.scene.run.case import chosen_books
from catenary.cases.scene.scene import Scene, end_of, strips_ahead
from catenary.meshgen.slowest_wave import bends, slowest_wave
from catenary.meshgen.topologies.all_topologies import listed, make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Role
from catenary.postproc.files.header import in_sentence, places_on_train
from catenary.postproc.record.snapshots.contents import OTHER_PARTS
from catenary.postproc.standards.rule_books import (
    DEFAULT,
    SYSTEMS,
    RuleBook,
    book_named,
    book_of,
    editions_of,
    shipped,
)
from catenary.solver.effects.effect import Limit

# Two heads cannot stand closer on a roof; their contacts would also share one finite element.
MIN_SEPARATION = 1.0
# Slack for sums of decimal lengths [m].
_TINY = 1e-6


def check(scene: Scene) -> None:
    """Raise ``UnfitScene`` with all in which a scene contradicts itself."""
    faults = faults_of(scene)
    if faults:
        raise UnfitScene(faults)


def faults_of(scene: Scene) -> list[Fault]:
    """All in which a scene contradicts itself."""
    found = _Findings()
    whole = found.collect(line_tables.check_topology, scene)
    for of_tables in _OF_TABLES:
        found.collect(of_tables, scene)
    if found.collect(_pantograph_names, scene):
        found.collect(pantographs.check_pantographs, scene)
        found.collect(pantographs.check_laws, scene)
    # Consequences of a wrong unit are not reported; a scene that is too large is not made.
    usual = found.collect(usual_faults, scene)
    line = _line(scene, found) if usual and whole else None
    if line is None or not found.collect(mesh_size.size_faults, scene):
        return found.faults
    line = listed(line)
    if not found.collect(line_tables.check_names, scene, line):
        return found.faults
    of_lines = (
        line_tables.check_dropper_lengths,
        check_recorded_parts,
        pantographs.check_tunnels,
        pantographs.check_crosswind,
        pantographs.check_wind,
        _speed,
        defects.check_defects,
        effects.check_idle,
    )
    for of_line in of_lines:
        found.collect(of_line, scene, line)
    if found.collect(_running, scene, line) and found.collect(_evaluation, scene):
        found.collect(_raising, scene)
        found.collect(line_tables.check_ends, scene, line)
        found.collect(line_tables.check_along, scene, line)
    if found.faults:
        return found.faults
    # Checks that may need multibody systems come last: other faults are reported at once.
    if found.collect(pantographs.check_mechanisms, scene, line):
        found.collect(pantographs.check_uplift, scene)
        found.collect(effects.check_requirements_of_defaults, scene)
        found.collect(pantographs.check_vehicle, scene, line)
        if found.collect(defects.check_incidents, scene, line):
            found.collect(numerics.check_window, scene)
    if not found.faults:
        # They ask the problem, which is made of a sound scene only.
        found.collect(effects.check_damped, scene)
        found.collect(effects.check_chosen_act, scene)
        found.collect(effects.check_twins, scene)
    return found.faults


@dataclass
class _Findings:
    """Faults that checks have found so far."""

    faults: list[Fault] = field(default_factory=list)

    def collect(self, check: Callable[..., Iterator[Fault]], *of: Any) -> bool:
        """Collect the faults that a check finds; True if there are none."""
        before = len(self.faults)
        try:
            self.faults.extend(check(*of))
        except SceneError as error:
            self.faults.extend(error.faults)
        except InputError as error:
            self.faults.append(Fault("", str(error)))
        return len(self.faults) == before


def _line(scene: Scene, found: _Findings) -> LineData | None:
    """The line of a scene, None if its parts do not fit together."""
    try:
        line = scene.line_data
    except InputError as error:
        found.faults.append(Fault("", str(error)))
        return None
    checks = line_tables.check_droppers_inside_spans, free.check_free_droppers
    inside = [found.collect(of_line, scene, line) for of_line in checks]
    return line if all(inside) and found.collect(line_tables.check_parts, scene, line) else None


def _test_keys(scene: Scene) -> Iterator[Fault]:
    known = known_keys(type(scene))
    for key in scene.test:
        if not is_known(key, known) or key.startswith("test."):
            where = f"in the [test] table {scene.origin.of('test')}"
            yield Fault("test", unknown_key(key, where, known))


def _pantograph_names(scene: Scene) -> Iterator[Fault]:
    for i, place in enumerate(scene.train.pantographs):
        if place.name not in scene.pantographs:
            yield from scene.among(f"train.pantographs.{i}.name", scene.pantographs)
        elif place.reversed and not pantographs.has_front(scene.pantographs[place.name]):
            yield scene.refused(
                f"train.pantographs.{i}.reversed",
                f"{place.name} is a chain of lumped masses, with no front but what "
                f"pantographs.{place.name}.aerodynamics.reversed gives it",
            )


def _separations(scene: Scene) -> Iterator[Fault]:
    behind = [place.behind_m for place in scene.train.pantographs]
    if behind[0] != 0:
        key = "train.pantographs.0.behind_m"
        yield scene.refused(key, "the first pantograph leads, so it must be 0")
    ahead = strips_ahead(scene)
    for i in range(1, len(behind)):
        strips = ahead[i - 1] + ahead[i]
        if behind[i] < behind[i - 1] + MIN_SEPARATION + strips - _TINY:
            because = f", because its strips and that one's take {strips:g} m" if strips else ""
            yield scene.refused(
                f"train.pantographs.{i}.behind_m",
                f"it must be at least {MIN_SEPARATION + strips:g} m more than the "
                f"{behind[i - 1]:g} m of the pantograph before it{because}",
            )


def _speed(scene: Scene, line: LineData) -> Iterator[Fault]:
    speed = scene.train.speed_km_h
    if not scene.holds(Limit.WAVE_SPEED):
        return
    made = make_line(line)
    wave = slowest_wave(made)
    if speed < 3.6 * wave:
        return
    wire = min(made.wires_of(Role.CONTACT), key=lambda one: one.wave_speed)
    of = f"tension_N = {wire.tension:g} and mass_kg_per_m = {wire.mass_per_length:g}"
    if bends(wave, wire.tension, wire.mass_per_length):
        of = f"bending_stiffness_N_m2 = {wire.bending_stiffness:g}, {of} between its supports"
    yield scene.refused(
        "train.speed_km_h",
        f"it must be below the wave speed of the contact wire ({3.6 * wave:.1f} km/h, which "
        f"{of} give it) unless effects.supercritical_speed = true",
    )


def _running(scene: Scene, line: LineData) -> Iterator[Fault]:
    first, last = line.running_range
    start, end = scene.train.start_m, end_of(scene)
    rear = scene.train.pantographs[-1].behind_m
    ahead = strips_ahead(scene)
    first, last = first + ahead[-1], last - max(ahead)
    inside = f"the running range is {first:g} to {last:g} m"
    if any(ahead):
        inside += ", strips included"
    if not first - _TINY <= start <= last + _TINY:
        yield scene.refused("train.start_m", f"it must lie inside the line: {inside}")
    if start - rear < first - _TINY:
        yield scene.refused(
            "train.start_m",
            f"the pantograph {rear:g} m behind would start at {start - rear:g} m, outside the "
            f"line: {inside}",
        )
    given = scene.train.end_m
    if given is not None and given > last + _TINY:
        yield scene.refused("train.end_m", f"it must lie inside the line: {inside}")
    if end <= start and given is None:
        yield scene.refused("train.start_m", f"it must lie before the end at {end:g} m")
    elif end <= start:
        yield scene.refused("train.end_m", f"it must be greater than train.start_m ({start:g} m)")
    elif end - start < scene.train.speed_km_h / 3.6 * scene.numerics.dt_s:
        yield scene.refused("numerics.dt_s", "the run would have no step at all")


def _evaluation(scene: Scene) -> Iterator[Fault]:
    start, end = scene.train.start_m, end_of(scene)
    stretch = scene.evaluation
    places = scene.train.pantographs
    for name, place in zip(places_on_train(len(places)), places, strict=True):
        who = in_sentence(name)
        covers = f"{who} only runs from {start - place.behind_m:g} to {end - place.behind_m:g} m"
        if stretch.from_m < start - place.behind_m - _TINY:
            yield scene.refused("evaluation.from_m", covers)
        if stretch.to_m > end - place.behind_m + _TINY:
            yield scene.refused("evaluation.to_m", covers)


def _raising(scene: Scene) -> Iterator[Fault]:
    run = (scene.evaluation.from_m - scene.train.start_m) / (scene.train.speed_km_h / 3.6)
    if scene.train.raise_time_s > run + _TINY:
        yield scene.refused(
            "train.raise_time_s",
            f"the leading pantograph reaches evaluation.from_m after {run:.3g} s and must be "
            "raised by then",
        )


def _standard(scene: Scene) -> Iterator[Fault]:
    judged = scene.evaluation
    for key, value, known in (
        ("evaluation.edition", judged.edition, editions_of(DEFAULT)),
        ("evaluation.system", judged.system, SYSTEMS),
    ):
        if value is not None and value not in known:
            yield scene.refused(key, f"it must be one of {', '.join(known)}")
            return
    if judged.edition is not None and judged.rules is not None:
        why = f'it is short for evaluation.rules = ["{DEFAULT}:{judged.edition}"]: take one away'
        yield scene.refused("evaluation.edition", why)
        return
    for place, name in enumerate(judged.chosen):
        try:
            book_named(name)
        except InputError as unknown:
            yield scene.refused(f"evaluation.rules.{place}", str(unknown))
            return
    if judged.own_rules is not None:
        try:
            book_of(
                judged.own_rules, f"evaluation.own_rules {scene.origin.of('evaluation.own_rules')}"
            )
        except InputError as wrong:
            yield Fault("evaluation.own_rules", str(wrong))
            return
    elif not judged.chosen:
        yield scene.refused("evaluation.rules", "without books a rules_file must be given")
        return
    try:
        books = chosen_books(judged)
    except InputError as twice:
        yield scene.fault("evaluation.rules", f"has a book twice: {twice}")
        return
    for name in judged.own_limits:
        if name not in _limits_read(books):
            readers = [book.key for book in shipped().values() if name in _limits_read([book])]
            why = f"no chosen rule book reads it; those that do are {', '.join(readers)}"
            yield scene.refused(f"evaluation.limits.{name}", why)


def _limits_read(books: Iterable[RuleBook]) -> set[str]:
    """Keys of ``evaluation.limits`` that books refer to."""
    rows = (row for book in books for rule in book.criteria for row in rule.limit)
    return {row.of_key for row in rows if row.of_key is not None}


def _mesh_file(scene: Scene) -> Iterator[Fault]:
    if scene.mesh.file is None:
        return
    try:
        found = Path(scene.mesh.file).is_file()
    except (OSError, ValueError):
        found = False
    if not found:
        yield scene.refused("mesh.file", "there is no such file")


def check_output(scene: Scene) -> Iterator[Fault]:
    """Spans that the line does not have."""
    output, n = scene.output, scene.line.n_spans
    for key in ("line_channels_spans", "field_spans"):
        spans = getattr(output, key)
        if spans is not None and spans[1] > n:
            yield scene.refused(f"output.{key}", f"the line has the spans 1 to {n}")


def check_recorded_parts(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Parts that the line does not have."""
    if scene.output.field_parts is None:
        return
    parts = [*(wire.name for wire in make_line(line).wires), *OTHER_PARTS]
    for part in scene.output.field_parts:
        if part not in parts:
            why = f"this line has {', '.join(parts)}"
            yield scene.refused("output.field_parts", why, value=part)


_MEANT = ", or case.accept_unusual = true if it is meant"


def usual_faults(scene: Scene) -> Iterator[Fault]:
    """A fault for every number that was probably written in another unit.

    None in a scene that says with ``case.accept_unusual`` that its numbers are meant.
    """
    if scene.case.accept_unusual:
        return
    plain = scene.model_dump(exclude_none=True)
    ranges = [key for key, usual in USUAL.items() if usual.least is not None]
    for pattern in ranges:
        yield from _faults(plain, pattern.split("."), "", scene.origin)


def _faults(value: Any, parts: list[str], key: str, origin: Origin) -> Iterator[Fault]:
    if parts and isinstance(value, list):
        for i, entry in enumerate(value):
            yield from _faults(entry, parts[1:], f"{key}.{i}", origin)
        return
    if parts:
        inner = value if isinstance(value, dict) else {}
        for name in inner if parts[0] == "*" else [parts[0]] if parts[0] in inner else []:
            below = f"{key}.{name}" if key else name
            yield from _faults(inner[name], parts[1:], below, origin)
        return
    for number in value if isinstance(value, list) else [value]:
        guess = unit_guess(key, number)
        if guess:
            unit = unit_of(key)
            yield Fault(key, f"{key} is {number:.12g} {unit} {origin.of(key)}; {guess}{_MEANT}")
            return


# Checks that need no other one.
_OF_TABLES: tuple[Callable[[Scene], Iterator[Fault]], ...] = (
    _test_keys,
    effects.check_effect_names,
    effects.check_requirements_of_chosen,
    effects.check_effect_data,
    line_tables.check_lateral,
    numerics.check_contact,
    numerics.check_iterations,
    _separations,
    _standard,
    _mesh_file,
    check_output,
)
