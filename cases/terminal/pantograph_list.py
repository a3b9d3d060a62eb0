"""What ``catenary list --pantographs`` prints: the ready pantographs."""

from __future__ import annotations

from collections.abc import Sequence

from catenary.mbs.library import READY, ReadyPantograph


def pantograph_table() -> str:
    """Name, chain, forces and source of each ready pantograph, a few lines each."""
    lines = []
    for name, ready in READY.items():
        chain = ready.chain
        lines += [
            name,
            f"  {_numbers(chain.masses)} kg, head first; {_numbers(chain.stiffnesses)} N/m and "
            f"{_numbers(chain.dampings)} N s/m below",
            f"  {_force(ready)}",
            f"  {ready.source}",
        ]
    return "\n".join(lines)


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _signed(value: float) -> str:
    return f" {'-' if value < 0 else '+'} {abs(value):g}"


def _force(ready: ReadyPantograph) -> str:
    if ready.static_force is None:
        return "no force of its own: static_force_N or static_force_by_speed is needed"
    text = f"{ready.static_force:g} N"
    if any(ready.uplift):
        a, b, c = ready.uplift
        terms = f"{a:g} v^2{_signed(b)} v{_signed(c)} N"
        text += f" + {terms} for v in km/h, never below {ready.static_force:g} N"
    return text
