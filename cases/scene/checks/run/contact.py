"""Whether contact law, effects and numerics of a scene fit together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.run.contact import HERTZ, WITH_RESTITUTION
from catenary.solver.problem.integrator_parameters import NEWMARK

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def check_contact(scene: Scene) -> Iterator[Fault]:
    """What contradicts itself about contact."""
    yield from _damping(scene)
    yield from _loss(scene)
    yield from _kinematic(scene)


def _damping(scene: Scene) -> Iterator[Fault]:
    contact, switches = scene.contact, scene.switches()
    law, on = contact.law, switches["contact_damping"]
    said = "contact_damping" in scene.effects
    if law == "linear":
        key, value, dissipates = "damping_N_s_per_m", contact.damping_N_s_per_m, "greater than 0"
        acts = value > 0
    elif law in WITH_RESTITUTION:
        assert contact.restitution is not None
        key, value, dissipates = "restitution", contact.restitution, "below 1"
        acts = value < 1
    else:
        if on:
            yield refusal(
                scene.origin,
                "effects.contact_damping",
                True,
                f"contact.law {law} has no damping; leave it out or take another law",
            )
        return
    key = f"contact.{key}"
    if on and not acts:
        why = f"effects.contact_damping is on and needs a value {dissipates}"
        yield refusal(scene.origin, key, value, why)
    if acts and not on and not said:
        yield refusal(
            scene.origin,
            key,
            value,
            "it acts only with effects.contact_damping = true; write that, or false to leave it "
            "out",
        )


def _loss(scene: Scene) -> Iterator[Fault]:
    if scene.contact.law in HERTZ and not scene.switches()["contact_loss"]:
        yield refusal(
            scene.origin,
            "effects.contact_loss",
            False,
            f"contact.law {scene.contact.law} has no force that pulls; take law linear",
        )


# Below it the force of a moving kinematic contact alternates with a growing amplitude:
# accelerations of Newmark's average acceleration remember a jump forever.
KINEMATIC_GAMMA = 0.55


def _kinematic(scene: Scene) -> Iterator[Fault]:
    if scene.contact.law != "kinematic":
        return
    numerics = scene.numerics
    for key, value, needed in (
        ("scheme", numerics.scheme, "one_solve"),
        ("coupling", numerics.coupling or "implicit", "implicit"),
    ):
        if value != needed:
            yield refusal(
                scene.origin,
                f"numerics.{key}",
                value,
                f"contact.law kinematic has no force before the motion is known: take {needed}",
            )
    if numerics.adaptive_tolerance_N is not None:
        yield refusal(
            scene.origin,
            "numerics.adaptive_tolerance_N",
            numerics.adaptive_tolerance_N,
            "contact.law kinematic has no stiffness to estimate an error with: take another law",
        )
    if scene.train.start_below_m:
        yield refusal(
            scene.origin,
            "train.start_below_m",
            scene.train.start_below_m,
            "contact.law kinematic has no gap that a head could rise through: take another law",
        )
    if numerics.integrator != NEWMARK:
        yield refusal(
            scene.origin,
            "numerics.integrator",
            numerics.integrator,
            "contact.law kinematic keeps line and pantographs together only if one method steps "
            f"both: take newmark, with numerics.newmark_gamma of at least {KINEMATIC_GAMMA:g}",
        )
    if numerics.newmark_gamma < KINEMATIC_GAMMA:
        yield refusal(
            scene.origin,
            "numerics.newmark_gamma",
            numerics.newmark_gamma,
            f"contact.law kinematic needs at least {KINEMATIC_GAMMA:g}, with "
            "numerics.newmark_beta at least 0.28: without numerical damping its force alternates",
        )
