"""Chains of lumped masses from the head down to the base: their data, ready chains, their steps.

A scene names a ready chain of a public source with ``model``. Other sources: EN 50318, annex (two
masses); the benchmark of ten codes of 2015 (three masses).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from catenary.mbs.air import AirForces, Uplift
from catenary.mbs.head.laws import Law, given_way
from catenary.mbs.head.pantograph import SteppedHead, head_of
from catenary.mbs.head.stepping import Raising, Stepping
from catenary.mbs.head.strips import ONE_STRIP, HeadParts, Strips, Turning, head_parts
from catenary.solver.kernels import native

# Force of the base spring over the static force that compresses the springs above it, with the head
# held and the base where it stands when raised: above this the base rises with the lift [-].
_TIED = 0.1
# Half of the time over which the speed of a base that is lowered, too, is found [s]: a half cosine
# of 0.1 s is off by (pi 1e-5 / 0.1)^2 / 6, round-off by 1e-11, and its ends by more.
_MOMENT = 1e-5


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


class LumpedPantograph(SteppedHead):
    """A lumped-mass pantograph advanced by Newmark's method, implicit in its contact force.

    Coordinates are the masses' heights with the springs relaxed when all are equal, and angles of
    a head that turns; see `strips`. Weights are balanced by the lifting mechanism, whose net lift
    on the last mass is ``static_force`` at the nominal head height, raised smoothly from zero. Of
    a chain that its base spring holds at a height the base rises in the same way, from where the
    chain stands with its springs relaxed: pressed against a base that stands already, its masses
    would start with the force of that spring, and few chains damp what follows.

    Parameters
    ----------
    data : LumpedData
    static_force : force on the wire at rest [N]
    nominal_height : head height at which the contact force at rest is ``static_force`` [m]
    stepping : Stepping
    air : forces of the air on head and last mass; without it there are none
    steady_air : force of the air on the last mass where the nominal height holds [N]
    """

    def __init__(
        self,
        data: LumpedData,
        static_force: float,
        nominal_height: float,
        stepping: Stepping,
        air: AirForces | None = None,
        steady_air: float = 0.0,
    ) -> None:
        head = data.head(rolls=stepping.lateral is not None)
        n = head.n + data.n_masses - 1
        super().__init__(head, n, stepping, air is None or air.is_steady)
        self._air = air
        self._lift_full = static_force
        # The lift acts on the last mass, which is the head itself if there is no other.
        own = int(np.flatnonzero(head.level)[-1])
        self._carrier = n - 1 if data.n_masses > 1 else own
        self._masses = np.concatenate([head.masses, data.masses[1:]])
        springs = chain_matrix(head.stiffness, data.stiffnesses[1:])
        dampers = chain_matrix(head.damping, data.dampings[1:])
        self._stiffness = np.ascontiguousarray(springs[:n, :n])
        self._damping = np.ascontiguousarray(dampers[:n, :n])
        self._base_stiffness, self._base_damping = data.stiffnesses[-1], data.dampings[-1]
        # The base spring carries nothing when the head is at its nominal height under the static
        # force, which compresses springs and laws between head and last mass. So does what the air
        # lifts the last mass with.
        pressing = static_force + steady_air
        compression = sum(data.given_way(pressing))
        compression += data.strips.compression(pressing)
        self._base_height = nominal_height + compression
        # A base that rises with the lift starts from where the chain was placed.
        self._tied, self._started_at = data.tied, self._base_height
        if self._tied:
            self._settled += 2.0 * _MOMENT
        if data.laws:
            first = nominal_height + data.strips.compression(pressing)
            rest = np.cumsum([first, *data.given_way(pressing)])
            self._put_laws(data.laws, [own, *range(head.n, n)], rest)
            self._step_by(self._on_springs(self._arrays))
        else:
            self._step_by(head_of(self._arrays, linear=self.linear_step()))

    @property
    def is_linear(self) -> bool:
        """Whether a step is linear in its state and in what drives it."""
        return not (self.is_regulated or self._has_laws)

    def linear_step(self) -> native.LinearStep:
        """A step without laws: new state = step @ state + drive * by_drive - by_force @ force, with
        the state (positions, velocities, accelerations)."""
        n = self._n
        one, none = np.eye(n), np.zeros((n, n))
        newmark = self._newmark
        predict_position = np.hstack([one, newmark.dt * one, newmark.predict_position * one])
        predict_velocity = np.hstack([none, one, newmark.predict_velocity * one])
        # Not by SciPy, which nothing else of a chain needs, and which takes longer both to import
        # and for so few masses.
        inverse = np.ascontiguousarray(
            np.linalg.inv(
                np.diag(self._masses)
                + newmark.velocity * self._damping
                + newmark.position * self._stiffness
            )
        )
        free = -inverse @ (self._stiffness @ predict_position + self._damping @ predict_velocity)
        step = np.vstack(
            [
                predict_position + newmark.position * free,
                predict_velocity + newmark.velocity * free,
                free,
            ]
        )
        unit = np.vstack([newmark.position * inverse, newmark.velocity * inverse, inverse])
        by_drive = np.ascontiguousarray(unit[:, self._carrier])
        return native.LinearStep(step, by_drive, unit @ self._push, inverse)

    @property
    def tie(self) -> tuple[float, float]:
        """Stiffness [N/m] and damping [N s/m] between the last mass and the base."""
        return self._base_stiffness, self._base_damping

    def _place(self, head_height: float, velocity: float) -> None:
        """A base that rises starts there."""
        self._started_at = head_height
        super()._place(head_height, velocity)

    def _put_inputs(self, times: np.ndarray, rows: np.ndarray, lifts: np.ndarray | None) -> None:
        part = self._part(times)
        rows["force"] = self._lift_full * part + self._base_stiffness * self._base_height
        if self._tied or lifts is not None:
            base = np.zeros((2, times.size)) if lifts is None else lifts[:2]
            base = base + self._rise(times) if self._tied else base
            rows["force"] += self._base_stiffness * base[0] + self._base_damping * base[1]
            if self._has_laws:
                rows["base"], rows["base_velocity"] = base
        if self._air is not None:
            on_head, on_frame, _ = self._air.at(times).T
            rows["force"] += on_frame
            rows["head_air"] = on_head
        if self.is_regulated:
            rows["part"] = part

    def _rise(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Height and velocity of a base that rises with the lift, above where it stands under all
        of it, at times (t,) [m], [m/s]."""
        way = self._started_at - self._base_height
        parts = self._part(np.maximum(times, 0.0))
        if isinstance(self._part, Raising):
            return way * (1.0 - parts), -way * self._part.rates(times)
        before, after = (
            self._part(np.maximum(times + shift, 0.0)) for shift in (-_MOMENT, _MOMENT)
        )
        return way * (1.0 - parts), way * (before - after) / (2.0 * _MOMENT)
