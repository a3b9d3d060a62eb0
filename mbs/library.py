"""Ready pantographs: lumped chains of public sources, which a scene names with ``model``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from catenary.mbs.lumped_data import LumpedData


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
