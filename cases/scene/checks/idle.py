"""Keys of a line that nothing reads: what they describe is not there."""

from __future__ import annotations

from collections.abc import Iterator

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.table import TAKE_AWAY
from catenary.cases.scene.line.droppers import FEWEST_SAGGING
from catenary.cases.scene.line.line_data import arm_tables, dropper_tables
from catenary.cases.scene.scene import Scene
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.postproc.evaluate.wording import counted


def check_idle(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Masses of arms and clamps, lateral places of clamped wires, errors of droppers and further
    overlaps of which there are none.

    Of an effect that the scene writes as false data may stand there.
    """
    if scene.origin.recorded:
        return
    yield from _arms(scene)
    yield from _clamps(scene)
    yield from _lateral_places(scene)
    yield from _dropper_lengths(scene, line)
    yield from _random(scene)
    yield from _sagging(scene)
    yield from _further_overlaps(scene, line)


def _arms(scene: Scene) -> Iterator[Fault]:
    for key, arm in arm_tables(scene.line).items():
        if arm.mass_kg_per_m and not arm.length_m and scene.effects.get("arm_inertia") is not False:
            why = f"an arm of length 0 has no mass by it: give {key}.length_m, or clamp_kg alone"
            yield scene.refused(f"{key}.mass_kg_per_m", why + TAKE_AWAY)


def _clamps(scene: Scene) -> Iterator[Fault]:
    """Clamps at the ends of free wires that none has."""
    wires = scene.line.wires or []
    names = {wire.name for wire in wires}
    for i, wire in enumerate(wires):
        if {wire.start, wire.end} & names:
            continue
        for name in ("clamp_kg", "clamp_stiffness_N_per_m"):
            if name in wire.model_fields_set:
                why = (
                    f"{wire.name} has no clamp: neither start nor end names a wire to which it is "
                    f"clamped{TAKE_AWAY}"
                )
                yield scene.refused(f"line.wires.{i}.{name}", why)


def _lateral_places(scene: Scene) -> Iterator[Fault]:
    """Lateral places of free wires that lie where the wires do to which they are clamped."""
    wires = scene.line.wires or []
    names = {wire.name for wire in wires}
    links = scene.line.links or []
    held = {link.wire for link in links if link.type in ("supports", "steady_arms")}
    for i, wire in enumerate(wires):
        n_clamped = len([end for end in (wire.start, wire.end) if end in names])
        if n_clamped == 2 and wire.name not in held:
            idle = ["stagger_m", "sideways_m"]
            why = (
                f"nothing holds {wire.name} sideways but the wires to which both of its ends are "
                "clamped"
            )
        elif (
            n_clamped and wire.role != "contact" and (wire.stagger_m, wire.course_m) == (None,) * 2
        ):
            idle = ["sideways_m"]
            why = (
                f"without stagger_m or course_m {wire.name} has the lateral place of the wire to "
                "which it is clamped"
            )
        else:
            continue
        for name in set(idle) & wire.model_fields_set:
            yield scene.refused(f"line.wires.{i}.{name}", why + TAKE_AWAY)


def _dropper_lengths(scene: Scene, line: LineData) -> Iterator[Fault]:
    name = "dropper_lengths"
    given = scene.irregularities.dropper_lengths is not None
    if given and scene.effects.get(name) is not False and not make_line(line).droppers:
        key = f"irregularities.{name}"
        yield scene.fault(
            key,
            f"changes nothing: the line has no droppers; leave it "
            f"out, or write effects.{name} = false",
        )


def _sagging(scene: Scene) -> Iterator[Fault]:
    """A sag at mid-span of droppers between a first and a last one, where there are none."""
    for key, table in dropper_tables(scene.line).items():
        if table.count is not None:
            most = table.count
        else:
            each = [len(pattern.positions_m) for pattern in table.patterns or ()]
            most = max([len(table.positions_m or ()), *each])
        if table.pre_sag_mid_mm and most < FEWEST_SAGGING and scene.effects.get("pre_sag", True):
            why = (
                "it is that of droppers between the first and the last one of a span, of which "
                f"there is none: spans have {counted(most, 'dropper')}"
            )
            at = f"{key}.pre_sag_mid_mm"
            yield scene.refused(at, why + TAKE_AWAY)


# What says how irregularities are drawn at random.
_DRAWN = ("exponent", "shortest_m", "longest_m", "cut_off", "seed")


def _random(scene: Scene) -> Iterator[Fault]:
    """How random irregularities are drawn, where none are."""
    for name in scene.irregularities.given:
        table = getattr(scene.irregularities, name)
        for part in _DRAWN if not table.standard_deviation_mm else ():
            if part in table.model_fields_set:
                key = f"irregularities.{name}.{part}"
                why = f"nothing is random without irregularities.{name}.standard_deviation_mm"
                yield scene.refused(key, why + TAKE_AWAY)


def _further_overlaps(scene: Scene, line: LineData) -> Iterator[Fault]:
    table = scene.line.overlap
    if table is None or line.overlaps is None or table.repeat_every_spans is None:
        return
    if len(line.overlaps.first) == len(table.first_span):
        next_one = table.first_span[-1] + table.repeat_every_spans
        last = line.n_spans - line.n_transition[1] - table.n_spans
        why = (
            f"it adds no overlap: the next one would begin in span {next_one}, and the last in "
            f"which one may begin is {last}"
        )
        key = "line.overlap.repeat_every_spans"
        yield scene.refused(key, why + TAKE_AWAY)
