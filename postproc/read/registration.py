"""Registration at rest: where steady arms hold the contact wires, and by what forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from catenary.postproc.files.csv_text import csv_text

_HEADS = (
    *("position [m]", "stagger [m]", "radial force [N]", "lift [N]"),
    *("slope [deg]", "force along the track [N]", "slew [deg]"),
)


class Registration(NamedTuple):
    """Steady arms in order along the track.

    Attributes
    ----------
    x : (n,) place along the track [m]
    stagger : (n,) lateral position of the wire there, to the left [m]
    force : (n, 3) of each arm on its wire: to the left, upwards and along the track [N]
    tension : (n,) of each as a bar, negative if its wire pushes it [N]
    wires : names of the wires that they hold, empty if it is one and the same
    """

    x: np.ndarray
    stagger: np.ndarray
    force: np.ndarray
    tension: np.ndarray
    wires: tuple[str, ...] = ()

    @classmethod
    def of(cls, table: Mapping[str, np.ndarray], wires: Sequence[str] = ()) -> Registration | None:
        """Registration from datasets ``arm_x``, ``arm_stagger`` and so on; None if one is missing.

        ``wires`` are the names of all wires of the line, to which ``arm_wire`` refers.
        """
        names = ("arm_x", "arm_stagger", "arm_force", "arm_tension")
        if any(name not in table for name in names):
            return None
        x, stagger, force, tension = (np.asarray(table[name], dtype=float) for name in names)
        order = np.argsort(x, kind="stable")
        held = np.asarray(table.get("arm_wire", []), dtype=int)
        named: tuple[str, ...] = ()
        if wires and np.unique(held).size > 1:
            named = tuple(wires[number] for number in held[order].tolist())
        return cls(x[order], stagger[order], force.reshape(-1, 3)[order], tension[order], named)

    @property
    def pushed(self) -> np.ndarray:
        """Mask of the arms that their wires push, (n,) bool."""
        return self.tension < 0.0

    def warnings(self) -> list[str]:
        """A sentence if wires push steady arms, none if not."""
        n = int(np.count_nonzero(self.pushed))
        if not n:
            return []
        most = int(np.argmin(self.tension))
        return [
            f"At rest wires push {n} of {self.tension.size} steady arms, the one at "
            f"{self.x[most]:.4g} m the most, with {-self.tension[most]:.0f} N. A steady arm has to "
            "be pulled: one that is pushed softens its wire, and folds over when the wire is "
            "lifted far enough for droppers near it to slacken."
        ]

    @property
    def _towards_hinge(self) -> np.ndarray:
        return np.where(self.pushed, -1.0, 1.0)[:, None] * self.force

    @property
    def slope(self) -> np.ndarray:
        """Slope of arms, rising from their wire to their hinge, (n,) [rad]; zero without force."""
        sideways, up, along = self._towards_hinge.T
        return np.arctan2(up, np.hypot(sideways, along))

    @property
    def slew(self) -> np.ndarray:
        """Angle by which hinges are ahead of wires along the track, from above, (n,) [rad]."""
        sideways, _, along = self._towards_hinge.T
        return np.arctan2(along, np.abs(sideways))

    @property
    def heads(self) -> list[str]:
        """The heads of the table."""
        return [*_HEADS, *(["wire"] if self.wires else [])]

    def rows(self) -> list[tuple[str, ...]]:
        """The columns of the table as text: place, stagger, radial force, lift, slope, what the arm
        pulls along the track by how much it is slewed, and its wire where there are several."""
        columns = (
            (self.x, 3),
            (self.stagger, 4),
            (self.force[:, 0], 1),
            (self.force[:, 1], 1),
            (np.rad2deg(self.slope), 2),
            (self.force[:, 2], 1),
            (np.rad2deg(self.slew), 2),
        )
        texts = [[_fixed(value, digits) for value in values] for values, digits in columns]
        return list(zip(*texts, *([self.wires] if self.wires else []), strict=True))

    def csv(self) -> str:
        """The table as CSV text."""
        return csv_text(self.heads, self.rows())


def _fixed(value: float, digits: int) -> str:
    """A number with so many decimals, without the sign of a zero."""
    return f"{round(float(value), digits) + 0.0:.{digits}f}"
