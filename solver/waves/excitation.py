"""Excitations of a contact wire in place of a train: a force that moves, a pulse, a hammer.

Data only, and what result files say of it; ``excitation_load`` makes loads of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

FORCE, PULSE, HAMMER = "force", "pulse", "hammer"
KINDS = (FORCE, PULSE, HAMMER)


@dataclass(frozen=True)
class MovingForce:
    """A force that moves along the contact wire, and may vary as a cosine.

    Attributes
    ----------
    force : its value, or the amplitude of what varies [N], upwards
    frequency : of the cosine [Hz], zero for a force that stays as it is
    start, speed : where it begins [m], and how fast it moves [m/s]
    rise : time in which it grows from zero, as half a cosine [s]
    """

    force: float
    frequency: float
    start: float
    speed: float
    rise: float

    @property
    def kind(self) -> str:
        """One of ``KINDS``."""
        return FORCE

    def place(self, time: np.ndarray) -> np.ndarray:
        """Places at times (n,) [s], shape (n,) [m]."""
        return self.start + self.speed * time

    def value(self, time: np.ndarray) -> np.ndarray:
        """Its value at times (n,) [s], shape (n,) [N]."""
        share = np.clip(time / self.rise, 0.0, 1.0) if self.rise > 0.0 else np.ones_like(time)
        grown = 0.5 * (1.0 - np.cos(np.pi * share))
        return self.force * grown * np.cos(2.0 * np.pi * self.frequency * time)

    def in_words(self) -> str:
        """The excitation in words."""
        varies = f" cos(2 pi {self.frequency:g} Hz t)" if self.frequency else ""
        return (
            f"a force of {self.force:g} N{varies} from {self.start:g} m on at "
            f"{3.6 * self.speed:.4g} km/h"
        )


@dataclass(frozen=True)
class Blow:
    """A force on one place of the contact wire over a short time.

    Attributes
    ----------
    at : place along the track [m]
    duration : [s]
    peak : largest force [N]
    hammer : half a sine, as of a hammer that rebounds; otherwise a whole (1 - cosine) / 2, which
        has less of the high frequencies
    """

    at: float
    duration: float
    peak: float
    hammer: bool

    @property
    def impulse(self) -> float:
        """Integral of the force over time [N s]."""
        return self.peak * self.duration * (2.0 / np.pi if self.hammer else 0.5)

    @property
    def kind(self) -> str:
        """One of ``KINDS``."""
        return HAMMER if self.hammer else PULSE

    def place(self, time: np.ndarray) -> np.ndarray:
        """Places at times (n,) [s], shape (n,) [m]."""
        return np.full(np.shape(time), self.at)

    def shape(self, share: np.ndarray) -> np.ndarray:
        """The force after shares (n,) of the duration, over its peak."""
        inside = np.clip(share, 0.0, 1.0)
        return np.asarray(np.sin(np.pi * inside) ** (1 if self.hammer else 2))

    def value(self, time: np.ndarray) -> np.ndarray:
        """Its value at times (n,) [s], shape (n,) [N]."""
        return self.peak * self.shape(time / self.duration)

    def in_words(self) -> str:
        """The excitation in words."""
        return (
            f"a {self.kind} of {self.impulse:.4g} N s at {self.at:g} m within {self.duration:g} s, "
            f"up to {self.peak:.4g} N"
        )


Excitation = MovingForce | Blow


def hammer(at: float, impulse: float, duration: float) -> Blow:
    """A half-sine blow of ``impulse`` [N s], upwards, within ``duration`` [s] at ``at`` [m]."""
    return Blow(at, duration, 0.5 * np.pi * impulse / duration, True)


def as_facts(excitation: Excitation) -> dict[str, Any]:
    """All of an excitation, plain enough for JSON; `excitation_of_facts` takes it back."""
    return {"kind": excitation.kind, **asdict(excitation), "says": excitation.in_words()}


def excitation_of_facts(facts: Mapping[str, Any]) -> Excitation:
    """The excitation of facts as `as_facts` makes them.

    Raises
    ------
    KeyError, TypeError, ValueError
        If they are none.
    """
    if facts["kind"] not in KINDS or not isinstance(facts["says"], str):
        raise ValueError(f"{facts['kind']} is no excitation")
    own: type[MovingForce | Blow] = MovingForce if facts["kind"] == FORCE else Blow
    names = (name for name in own.__dataclass_fields__ if name != "hammer")
    numbers = {name: float(facts[name]) for name in names}
    if not np.isfinite(list(numbers.values())).all() or numbers.get("duration", 1.0) <= 0.0:
        raise ValueError("an excitation has finite numbers")
    if own is MovingForce:
        return MovingForce(**numbers)
    return Blow(**numbers, hammer=facts["kind"] == HAMMER)
