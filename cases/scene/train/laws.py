"""Forces on a pantograph: nonlinear laws, a regulated lift, aerodynamic uplift; in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from catenary.cases.scene.keys.table import PAIR, Table, ascending, ascending_pairs, exactly_one
from catenary.cases.scene.keys.units import speed_from_km_h
from catenary.mbs.air import Polynomial, Uplift
from catenary.mbs.air import Table as SpeedTable
from catenary.mbs.head.laws import Law, Regulation

# Straight lines through more would make a law as stiff as the stiffest of its parts.
_STIFFEST = 1e8


def _rising(pairs: list[list[float]]) -> list[list[float]]:
    ascending_pairs(pairs)
    for (x, low), (next_x, high) in zip(pairs[:-1], pairs[1:], strict=True):
        if high < low:
            raise ValueError(f"must not fall, but its force goes from {low:g} to {high:g} N")
        if high - low > _STIFFEST * (next_x - x):
            raise ValueError(f"must not rise by more than {_STIFFEST:g} a unit, near {x:g}")
    return pairs


def _braking(pairs: list[list[float]]) -> list[list[float]]:
    for x, force in pairs:
        if x * force < 0 or (x == 0 and force != 0):
            raise ValueError(f"must brake, but has {force:g} N at {x:g} m/s")
    return pairs


def _pushing(pairs: list[list[float]]) -> list[list[float]]:
    if pairs[0][1] != 0 or pairs[0][0] < 0:
        raise ValueError("must begin with a force of 0 N at a height of 0 m or more")
    return pairs


Rising = Annotated[list[PAIR], Field(min_length=2, max_length=100), AfterValidator(_rising)]
Braking = Annotated[Rising, AfterValidator(_braking)]
Pushing = Annotated[Rising, AfterValidator(_pushing)]


class _Law(Table):
    at_mass: int | None = Field(
        None, ge=1, le=20, description="which mass it holds, 1 is the head; the last one if absent"
    )


class LimiterTable(_Law):
    """Pushes a mass down above a height: an uplift limiter or a stop."""

    type: Literal["limiter"] = Field(description="kind of law")
    rise_m: float | None = Field(
        None, ge=0, le=5, description="above where the mass is at the nominal height of the head"
    )
    stiffness_N_per_m: float | None = Field(
        None, gt=0, le=_STIFFEST, description="of the stop, with rise_m"
    )
    force_by_rise: Pushing | None = Field(
        None, description="pairs of rise [m] and force [N], in place of a stiffness"
    )

    @model_validator(mode="after")
    def _one_way(self) -> LimiterTable:
        exactly_one(self, "stiffness_N_per_m", "force_by_rise")
        if (self.rise_m is None) != (self.stiffness_N_per_m is None):
            raise ValueError("needs rise_m and stiffness_N_per_m together, or force_by_rise alone")
        return self


class PneumaticDamperTable(_Law):
    """A damper that resists differently up and down, on a mass and what is below it."""

    type: Literal["damper"] = Field(description="kind of law")
    up_N_s_per_m: float | None = Field(
        None, ge=0, le=1e6, description="while the mass rises from what is below it"
    )
    down_N_s_per_m: float | None = Field(None, ge=0, le=1e6, description="while it sinks")
    force_by_velocity: Braking | None = Field(
        None, description="pairs of velocity [m/s] and force [N], > 0 while the mass rises"
    )

    @model_validator(mode="after")
    def _one_way(self) -> PneumaticDamperTable:
        exactly_one(self, "up_N_s_per_m", "force_by_velocity")
        if (self.up_N_s_per_m is None) != (self.down_N_s_per_m is None):
            raise ValueError(
                "needs up_N_s_per_m and down_N_s_per_m together, or force_by_velocity alone"
            )
        return self


class StiffeningSpringTable(_Law):
    """A spring that is not linear, between a mass and what is below it."""

    type: Literal["spring"] = Field(description="kind of law")
    force_by_extension: Rising = Field(
        description="pairs of extension [m] from relaxed springs and force [N], > 0 pulling the "
        "mass down; an arm's from its nominal height"
    )


class FrictionTable(_Law):
    """Dry friction between a mass and what is below it."""

    type: Literal["friction"] = Field(description="kind of law")
    force_N: float = Field(gt=0, le=1e4, description="while it slides")
    velocity_m_per_s: float = Field(
        1e-3, ge=1e-5, le=1, description="up to which the force builds up"
    )


LawTable = Annotated[
    LimiterTable | PneumaticDamperTable | StiffeningSpringTable | FrictionTable,
    Field(discriminator="type"),
]


class GainsTable(Table):
    """Gains of a controller where a value is measured."""

    at: float = Field(ge=-1e6, le=1e6, description="measured value [N] or [m]")
    error: float = Field(0.0, ge=0, le=1e6, description="gain of the error [N/N] or [N/m]")
    integral_per_s: float = Field(0.0, ge=0, le=1e6, description="gain of its integral over time")
    rate_s: float = Field(0.0, ge=0, le=1e5, description="gain of its rate")


class RegulationTable(Table):
    """A sampled PID controller that changes the static force under way."""

    measures: Literal["contact_force", "head_height"] = Field(description="what it holds")
    target: float = Field(ge=-1e3, le=1e3, description="wanted value, in N or m")
    gains: list[GainsTable] = Field(
        min_length=1, max_length=100, description="over the measured value, linear in between"
    )
    least_N: float = Field(-50.0, ge=-1e3, le=0, description="least force that it adds")
    most_N: float = Field(50.0, ge=0, le=1e3, description="largest force that it adds")
    sample_s: float = Field(0.01, ge=1e-6, le=10, description="time between two samples")
    filter_s: float = Field(
        0.0, ge=0, le=100, description="time constant of a filter of first order before samples"
    )
    delay_s: float = Field(0.0, ge=0, le=10, description="until a force acts; whole samples")
    from_s: float = Field(0.0, ge=0, le=1e5, description="time of the first sample")

    @model_validator(mode="after")
    def _consistent(self) -> RegulationTable:
        ascending([row.at for row in self.gains], "the values at of its gains")
        if not any(row.error or row.integral_per_s or row.rate_s for row in self.gains):
            raise ValueError("must have a gain above 0, but all are 0")
        if self.least_N == self.most_N:
            raise ValueError("must have room between least_N and most_N, but both are 0")
        samples = self.delay_s / self.sample_s
        if abs(samples - round(samples)) > 1e-6:
            raise ValueError(
                f"must have a delay of whole samples, but delay_s is {self.delay_s:g} and sample_s "
                f"{self.sample_s:g}"
            )
        if samples > 1000:
            raise ValueError(f"must have a delay of at most 1000 samples, but it is {samples:g}")
        return self


# Begin of the free side of a limiter [m]: its force is zero from there up to its rise.
_BELOW = -1.0


def laws_of(tables: Sequence[LawTable], n_masses: int) -> tuple[Law, ...]:
    """Laws of a pantograph of so many masses, the head first."""
    return tuple(_law(table, n_masses) for table in tables)


def _law(table: LawTable, n: int) -> Law:
    mass = (n if table.at_mass is None else table.at_mass) - 1
    if isinstance(table, LimiterTable):
        pairs = table.force_by_rise
        if pairs is None:
            assert table.rise_m is not None and table.stiffness_N_per_m is not None
            pairs = [[table.rise_m, 0.0], [table.rise_m + 1.0, table.stiffness_N_per_m]]
        return Law(mass, n, False, *_points([[_BELOW, 0.0], *pairs]), of_roof=True)
    below = mass + 1
    if isinstance(table, PneumaticDamperTable):
        pairs = table.force_by_velocity
        if pairs is None:
            assert table.up_N_s_per_m is not None and table.down_N_s_per_m is not None
            pairs = [[-1.0, -table.down_N_s_per_m], [0.0, 0.0], [1.0, table.up_N_s_per_m]]
        return Law(mass, below, True, *_points(pairs))
    if isinstance(table, FrictionTable):
        v, force = table.velocity_m_per_s, table.force_N
        pairs = [[-2.0 * v, -force], [-v, -force], [v, force], [2.0 * v, force]]
        return Law(mass, below, True, *_points(pairs))
    return Law(mass, below, False, *_points(table.force_by_extension))


def _points(pairs: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    points, forces = zip(*pairs, strict=True)
    return tuple(points), tuple(forces)


def regulation_of(table: RegulationTable | None) -> Regulation | None:
    """The controller of a lift, None if there is none."""
    if table is None:
        return None
    return Regulation(
        of_height=table.measures == "head_height",
        target=table.target,
        gains=tuple((row.at, row.error, row.integral_per_s, row.rate_s) for row in table.gains),
        least=table.least_N,
        most=table.most_N,
        sample_time=table.sample_s,
        filter_time=table.filter_s,
        delay=table.delay_s,
        from_time=table.from_s,
    )


_Coefficient = Annotated[float, Field(ge=-1e4, le=1e4)]
# More than any pantograph is lifted by [N], and faster than any train meets air [km/h].
MOST_UPLIFT, FASTEST = 2000.0, 1500.0


class UpliftTable(Table):
    """Aerodynamic uplift in one running direction."""

    uplift_polynomial: list[_Coefficient] | None = Field(
        None,
        min_length=1,
        max_length=6,
        description="uplift [N] as a polynomial of the air's speed [km/h], its constant first",
    )
    uplift_by_speed: list[Annotated[list[float], Field(min_length=2, max_length=2)]] | None = Field(
        None,
        min_length=2,
        max_length=1000,
        description="pairs of the air's speed [km/h] and uplift [N], linear in between; beyond the "
        "ends it goes on with the square of the speed",
    )
    head_share: float = Field(
        1.0, ge=0, le=1, description="part of the uplift on the head; the rest is on its carrier"
    )

    @model_validator(mode="after")
    def _one_uplift(self) -> UpliftTable:
        exactly_one(self, "uplift_polynomial", "uplift_by_speed")
        pairs = self.uplift_by_speed or []
        ascending([pair[0] for pair in pairs], "the speeds of uplift_by_speed")
        for speed, force in pairs:
            if not 0 <= speed <= FASTEST:
                raise ValueError(
                    f"must have speeds between 0 and {FASTEST:g} km/h in uplift_by_speed, but one "
                    f"is {speed:g}"
                )
            if abs(force) > MOST_UPLIFT:
                raise ValueError(
                    f"must have forces within {MOST_UPLIFT:g} N in uplift_by_speed, but one is "
                    f"{force:g}"
                )
        return self


class AerodynamicsTable(UpliftTable):
    """Aerodynamic uplift of a pantograph on top of its static force."""

    reversed: UpliftTable | None = Field(
        None, description="the same for one that runs the other way round"
    )


def uplift_of(table: AerodynamicsTable | None, reversed: bool) -> Uplift | None:
    """Uplift of a pantograph that runs as it is described, or the other way round."""
    if table is None:
        return None
    own: UpliftTable = table
    if reversed and table.reversed is not None:
        own = table.reversed
    return Uplift(_force(own), own.head_share)


def _force(table: UpliftTable) -> Polynomial | SpeedTable:
    if table.uplift_polynomial is not None:
        unit = speed_from_km_h(1.0)
        return Polynomial(tuple(c / unit**k for k, c in enumerate(table.uplift_polynomial)))
    assert table.uplift_by_speed is not None
    speeds, forces = zip(*table.uplift_by_speed, strict=True)
    return SpeedTable(tuple(speed_from_km_h(speed) for speed in speeds), forces)
