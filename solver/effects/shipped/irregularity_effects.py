"""Effects of irregularities: heights of contact wires, their running surface, dropper lengths."""

from __future__ import annotations

from dataclasses import replace

from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import hardware_effects  # noqa: F401  (built before)

register(
    Effect(
        "contact_wire_height",
        "irregular heights of the contact wires at their droppers",
        "heights that droppers are cut for; [irregularities.contact_wire_height]",
        "sums of sines after Shinozuka and Jan (1972); table",
        default=True,
        requires=("gravity",),
        data="irregularities.contact_wire_height",
        applies=lambda p: p.irregularities.heights is not None,
        law=lambda laws, p: replace(laws, irregular_heights=p.irregularities.heights),
        after_cutting=True,
        cut_for=True,
    )
)
register(
    Effect(
        "dropper_lengths",
        "droppers that are cut too long or too short",
        "errors of length, by which the line rests otherwise; [irregularities.dropper_lengths]",
        "static equilibrium with given lengths of droppers that only pull",
        default=True,
        requires=("gravity",),
        data="irregularities.dropper_lengths",
        applies=lambda p: p.irregularities.lengths is not None,
        law=lambda laws, p: replace(laws, length_errors=p.irregularities.lengths),
        after_cutting=True,
    )
)
register(
    Effect(
        "running_surface",
        "waviness of the contact wires' running surface",
        "a height and a slope at each contact; [irregularities.running_surface]",
        "sums of sines after Shinozuka and Jan (1972); table",
        default=True,
        data="irregularities.running_surface",
        applies=lambda p: p.irregularities.surface is not None,
        law=lambda laws, p: replace(
            laws, surface=(*laws.surface, *filter(None, [p.irregularities.surface]))
        ),
    )
)
