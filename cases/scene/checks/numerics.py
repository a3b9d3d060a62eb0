"""Whether contact law, iterations and window of a scene fit together."""

from __future__ import annotations

from collections.abc import Iterator

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.table import take_away
from catenary.cases.scene.run.contact import HERTZ, WITH_RESTITUTION
from catenary.cases.scene.scene import Scene, problem_of
from catenary.solver.problem.integrator_parameters import NEWMARK
from catenary.solver.window.choice import why_no_window


def check_contact(scene: Scene) -> Iterator[Fault]:
    """Contradictions of contact law, effects and numerics."""
    yield from _damping(scene)
    yield from _loss(scene)
    yield from _kinematic(scene)


def _damping(scene: Scene) -> Iterator[Fault]:
    contact, switches = scene.contact, scene.switches()
    law, on = contact.law, switches["contact_damping"]
    if law == "linear":
        key, value, dissipates = "damping_N_s_per_m", contact.damping_N_s_per_m, "greater than 0"
        acts = value > 0
    elif law in WITH_RESTITUTION:
        assert contact.restitution is not None
        key, value, dissipates = "restitution", contact.restitution, "below 1"
        acts = value < 1
    else:
        if on:
            yield scene.refused(
                "effects.contact_damping",
                f"contact.law {law} has no damping; leave it out or take another law",
            )
        return
    key = f"contact.{key}"
    if on and not acts:
        yield scene.refused(key, f"effects.contact_damping is on and needs a value {dissipates}")
    if acts:
        yield from scene.needs_effect("contact_damping", key)


def _loss(scene: Scene) -> Iterator[Fault]:
    if scene.contact.law in HERTZ and not scene.switches()["contact_loss"]:
        yield scene.refused(
            "effects.contact_loss",
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
            yield scene.refused(
                f"numerics.{key}",
                f"contact.law kinematic has no force before the motion is known: take {needed}",
            )
    if numerics.adaptive_tolerance_N is not None:
        yield scene.refused(
            "numerics.adaptive_tolerance_N",
            "contact.law kinematic has no stiffness to estimate an error with: take another law",
        )
    if scene.train.start_below_m:
        yield scene.refused(
            "train.start_below_m",
            "contact.law kinematic has no gap that a head could rise through: take another law",
        )
    if numerics.integrator != NEWMARK:
        yield scene.refused(
            "numerics.integrator",
            "contact.law kinematic keeps line and pantographs together only if one method steps "
            f"both: take newmark, with numerics.newmark_gamma of at least {KINEMATIC_GAMMA:g}",
        )
    if numerics.newmark_gamma < KINEMATIC_GAMMA:
        yield scene.refused(
            "numerics.newmark_gamma",
            f"contact.law kinematic needs at least {KINEMATIC_GAMMA:g}, with "
            "numerics.newmark_beta at least 0.28: without numerical damping its force alternates",
        )


_CORRECTED = 'scheme = "fixed_point"'
_EXCHANGED = 'coupling = "iterated"'
# Choices of numerics that read each key.
_READ_BY = {
    "eps_d_m": (_CORRECTED,),
    "eps_v_m_per_s": (_CORRECTED,),
    "eps_force_N": (_EXCHANGED,),
    "max_iterations": (_CORRECTED, _EXCHANGED),
}


def check_iterations(scene: Scene) -> Iterator[Fault]:
    """Keys of iterations that the scene's scheme does not make."""
    numerics = scene.numerics
    if scene.origin.recorded:
        return
    made = {
        _CORRECTED: numerics.scheme == "fixed_point",
        _EXCHANGED: numerics.coupling == "iterated",
    }
    coupling = f" and coupling {numerics.coupling or 'implicit'}"
    scheme = numerics.scheme + (coupling if numerics.scheme == "one_solve" else "")
    for name, readers in _READ_BY.items():
        if name in numerics.model_fields_set and not any(made[reader] for reader in readers):
            needed = " or ".join(f"numerics.{reader}" for reader in readers)
            why = f"nothing reads it with scheme {scheme}; take {needed}, or leave the key out"
            yield scene.refused(f"numerics.{name}", why + take_away())


def check_window(scene: Scene) -> Iterator[Fault]:
    """A window with a scheme that has none."""
    if scene.window.mode == "off":
        return
    why = why_no_window(problem_of(scene))
    if why:
        yield scene.refused("window.mode", f"it must be off, as {why}")
