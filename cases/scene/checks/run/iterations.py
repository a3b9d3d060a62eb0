"""Whether tolerances and numbers of iterations are given to a scheme that iterates."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.table import TAKE_AWAY

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

_CORRECTED = 'scheme = "fixed_point"'
_EXCHANGED = 'coupling = "iterated"'
# What reads each key.
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
            yield refusal(
                scene.origin, f"numerics.{name}", getattr(numerics, name), why + TAKE_AWAY
            )
