"""A chain of lumped masses as data, its matrices, and ready chains; `lumped` makes it run.

A scene names a ready chain of a public source with ``model``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from catenary.mbs.air import Uplift
from catenary.mbs.head.laws import Law, given_way
from catenary.mbs.head.strips import ONE_STRIP, HeadParts, Strips, Turning, head_parts

# Force of the base spring over the static force that compresses the springs above it, with the head
# held and the base where it stands when raised: above this the base rises with the lift [-].
_TIED = 0.1


@dataclass(frozen=True)
class LumpedData:
    """A chain of masses, head first.

    ``masses`` [kg], shape (n,); ``stiffnesses`` [N/m] and ``dampings`` [N s/m], shape (n,): entry
    i joins mass i to mass i + 1, the last entry joins the last mass to the base. The first mass is
    the whole head, ``strips`` included, which may turn about the track as ``roll`` says. The air
    lifts it by ``uplift``; ``crosswind_factor`` is what a cross wind counts in the air's speed
    (`wind.airflow`). ``laws`` that are not linear act besides.
    """

    masses: tuple[float, ...]
    stiffnesses: tuple[float, ...]
    dampings: tuple[float, ...]
    strips: Strips = ONE_STRIP
    roll: Turning | None = None
    uplift: Uplift | None = None
    laws: tuple[Law, ...] = ()
    crosswind_factor: float = 0.0

    @property
    def meets_air(self) -> bool:
        """Whether the air has forces on it."""
        return self.uplift is not None

    @property
    def n_masses(self) -> int:
        return len(self.masses)

    @property
    def compliance(self) -> float:
        """Compliance of the springs between head and last mass, the strips' included [m/N]."""
        return sum(1.0 / k for k in self.stiffnesses[:-1]) + self.strips.compression(1.0)

    def given_way(self, force: float) -> tuple[float, ...]:
        """How far springs, and laws beside them, between neighbours give way under a ``force`` at
        rest [N]: (n - 1,) [m]."""
        springs = enumerate(self.stiffnesses[:-1])
        return tuple(given_way(force, stiffness, self.laws, i) for i, stiffness in springs)

    @property
    def base_stiffness(self) -> float:
        """Stiffness between last mass and base with the head at its nominal height [N/m]."""
        last = self.n_masses - 1
        beside = [law for law in self.laws if law.mass == last and not (law.of_rate or law.of_roof)]
        return self.stiffnesses[-1] + sum(law.stiffness for law in beside)

    @property
    def tied(self) -> bool:
        """Whether its base spring holds it at a height: it is then raised with its base."""
        return self.base_stiffness * self.compliance > _TIED

    @property
    def height_stiffness(self) -> float:
        """Fall of its force by the rise of its head [N/m]."""
        base = self.base_stiffness
        return base / (1.0 + base * self.compliance)

    def chain(self, values: tuple[float, ...]) -> np.ndarray:
        """Matrix of springs (or dampers) between neighbours, the last to ground, shape (n, n)."""
        n = len(values)
        return chain_matrix(np.zeros((1, 1)), values)[:n, :n]

    def head(self, rolls: bool) -> HeadParts:
        """The head on the second mass, or on the base if there is none."""
        values = self.masses[0], self.stiffnesses[0], self.dampings[0]
        return head_parts(*values, self.strips, self.roll if rolls else None)


def chain_matrix(head: np.ndarray, below: tuple[float, ...]) -> np.ndarray:
    """A head's matrix with springs (or dampers) ``below`` its carrier, the last one to the base."""
    n = len(head) + len(below)
    matrix = np.zeros((n, n))
    matrix[: len(head), : len(head)] = head
    for upper, value in enumerate(below, start=len(head) - 1):
        pair = slice(upper, upper + 2)
        matrix[pair, pair] += value * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return matrix


@dataclass(frozen=True)
class ReadyPantograph:
    """A chain of masses of a public source.

    Attributes
    ----------
    chain : masses, springs and dampers, head first
    source : where they are from
    static_force : on a wire at standstill [N], None if the source has none
    uplift : aerodynamic addition to it [N], as coefficients (a, b, c) of a v^2 + b v + c over the
        speed v in km/h, as sources have it
    """

    chain: LumpedData
    source: str
    static_force: float | None = None
    uplift: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def force_at(self, speed_km_h: float) -> float | None:
        """Mean force on the wire at a speed [N], None if the source has no force.

        The air only lifts: below the speed at which its law becomes negative it adds nothing.
        """
        if self.static_force is None:
            return None
        a, b, c = self.uplift
        return self.static_force + max((a * speed_km_h + b) * speed_km_h + c, 0.0)


READY: Mapping[str, ReadyPantograph] = MappingProxyType(
    {
        "en50318_2002": ReadyPantograph(
            LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0)),
            "EN 50318:2002, reference model",
            static_force=120.0,
        ),
        "en50318_2018": ReadyPantograph(
            LumpedData((7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0)),
            "benchmark of Bruni et al., Vehicle System Dynamics 53(3), 2015; EN 50318:2018",
        ),
        "dsa380": ReadyPantograph(
            LumpedData((7.12, 6.0, 5.8), (9430.0, 14100.0, 0.1), (0.0, 0.0, 70.0)),
            "Wang et al., extended Habedank arc model, IEEE Trans., tables I to III",
            static_force=70.0,
            uplift=(0.00095, 0.0017, -0.2),
        ),
        "ambrosio2012": ReadyPantograph(
            LumpedData((7.8, 25.7), (6000.0, 0.0), (26.0, 0.22)),
            "seven bodies of Ambrosio et al. 2012, reduced to two masses at 1.418 m",
            static_force=150.0,
        ),
    }
)
