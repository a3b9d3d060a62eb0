"""The line as an engineer describes it: spans, wires, droppers, arms; SI units, no mesh yet.

Axes: x along the track from the first anchor, y lateral, z up from the top of rail.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Wire:
    """A tensioned wire: tension [N], mass per length [kg/m], bending stiffness EI [N m2]."""

    tension: float
    mass_per_length: float
    bending_stiffness: float

    @property
    def wave_speed(self) -> float:
        """Speed of transverse waves on the wire as a string, sqrt(F/rho) [m/s] (paper eq. 1.1)."""
        return float(np.sqrt(self.tension / self.mass_per_length))


@dataclass(frozen=True)
class DropperKind:
    """What all droppers of a line share.

    Exactly one of ``stiffness`` [N/m] and ``axial_stiffness`` EA [N] is given; with EA the
    stiffness of each dropper is EA over its own length. Clamp masses in kg.
    """

    stiffness: float | None
    axial_stiffness: float | None
    mass_per_length: float
    messenger_clamp_mass: float
    contact_clamp_mass: float


@dataclass(frozen=True)
class SteadyArm:
    """A steady arm hinged at its registration end and clamped to the contact wire.

    length [m], mass per length [kg/m], clamp mass [kg], vertical stiffness at the wire [N/m].
    ``holds_height``: whether the arm holds the contact wire at its height at rest and so carries
    weight there; otherwise the wire hangs freely between the droppers next to the arm.
    """

    length: float
    mass_per_length: float
    clamp_mass: float
    stiffness: float
    holds_height: bool = False


@dataclass(frozen=True)
class Line:
    """A simple catenary: one messenger wire, one contact wire, vertical droppers.

    Attributes
    ----------
    span_lengths : (n_spans,) [m]
    dropper_positions : per span, distances from the span's left support, ascending [m]
    pre_sag : per span, per dropper: how far the contact wire hangs below ``contact_height`` [m]
    stagger : (n_spans + 1,) lateral position of the contact wire at each support [m]
    contact_height : height of the contact wire at the supports of the running spans [m]
    encumbrance : height of the messenger wire above ``contact_height`` at the supports [m]
    support_stiffness : vertical stiffness of a messenger-wire support [N/m]
    n_transition : spans at the start and at the end in which the contact wire rises to the
        tensioner
    transition_rise : height gained by the contact wire over all transition spans of one end [m]
    """

    span_lengths: tuple[float, ...]
    dropper_positions: tuple[tuple[float, ...], ...]
    pre_sag: tuple[tuple[float, ...], ...]
    stagger: tuple[float, ...]
    contact_height: float
    encumbrance: float
    contact_wire: Wire
    messenger_wire: Wire
    dropper: DropperKind
    support_stiffness: float
    steady_arm: SteadyArm
    n_transition: tuple[int, int]
    transition_rise: float

    @property
    def n_spans(self) -> int:
        return len(self.span_lengths)

    @property
    def support_positions(self) -> np.ndarray:
        """Positions of all masts, both anchors included, shape (n_spans + 1,) [m]."""
        return np.concatenate([[0.0], np.cumsum(self.span_lengths)])

    @property
    def running_range(self) -> tuple[float, float]:
        """Where a pantograph may run: from the end of the first transition to the start of the
        last one [m]."""
        masts = self.support_positions
        return float(masts[self.n_transition[0]]), float(masts[self.n_spans - self.n_transition[1]])

    def target_height(self, x: np.ndarray) -> np.ndarray:
        """Height that the contact wire is to have without pre-sag, shape as ``x`` [m].

        Constant in the running spans; in the transition spans a parabola that leaves the running
        height without a kink and has gained ``transition_rise`` at the anchor.
        """
        x = np.asarray(x, dtype=float)
        masts = self.support_positions
        start, end = self.running_range
        height = np.full_like(x, self.contact_height)
        if self.n_transition[0]:
            into = np.clip((start - x) / (start - masts[0]), 0.0, None)
            height += self.transition_rise * into**2
        if self.n_transition[1]:
            into = np.clip((x - end) / (masts[-1] - end), 0.0, None)
            height += self.transition_rise * into**2
        return height
