"""A measured passage in SI units, and what a run has of the same pantograph."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import binary_dilation, binary_opening

from catenary.base.errors import InputError
from catenary.postproc.evaluate import filters


@dataclass(frozen=True)
class MeasuredForce:
    """Contact force and head height measured at a pantograph, at even steps of place.

    Attributes
    ----------
    pantograph : number on the train, from 0
    place : (n,) as the file says [m]
    force : (n,) >= 0 in compression, NaN where the file has none [N]
    head_height : (n,) above top of rail [m], None if not measured
    noise, height_noise : standard deviations of the noise of a sample of force [N] and height [m],
        zero if not stated
    bias, height_bias : standard deviations of an unknown constant in force [N] and height [m]
    """

    pantograph: int
    place: np.ndarray
    force: np.ndarray
    head_height: np.ndarray | None = None
    noise: float = 0.0
    height_noise: float = 0.0
    bias: float = 0.0
    height_bias: float = 0.0


@dataclass(frozen=True)
class MeasuredUplift:
    """Largest uplifts at supports.

    Attributes
    ----------
    place : (n,) as the file says [m]
    largest : (n,) [m]
    noise : standard deviation of each [m], zero if not stated
    """

    place: np.ndarray
    largest: np.ndarray
    noise: float = 0.0


@dataclass(frozen=True)
class Passage:
    """A measured passage.

    Attributes
    ----------
    name : of the file
    forces : a pantograph each
    cut_off : bandwidth [Hz]
    is_filtered : whether the file's values have passed a filter of this bandwidth
    by_time : whether places come from a clock
    stretch : begin and end of what is compared [m]
    uplift : at supports, None if not measured
    tolerances : replacements of the usual ones, by name of the quantity, SI units
    """

    name: str
    forces: list[MeasuredForce]
    cut_off: float
    is_filtered: bool
    by_time: bool
    stretch: tuple[float, float]
    uplift: MeasuredUplift | None = None
    tolerances: dict[str, float] = field(default_factory=dict)

    def in_band(self, values: np.ndarray, dt: float) -> np.ndarray:
        """Values (n,) of the file, ``dt`` [s] apart, below the cut-off.

        Raises
        ------
        InputError
            If there are too few samples a second for the filter.
        """
        if 2.0 * self.cut_off * dt >= 1.0:
            raise InputError(
                f"{self.name} has {1.0 / dt:.4g} samples a second, too few for the filter of "
                f"measured.filter_Hz = {self.cut_off:g}"
            )
        if self.is_filtered:
            return values
        return filters.low_pass(values, dt, self.cut_off)

    def noise_in_band(self, noise: float, dt: float) -> float:
        """Standard deviation of the noise after the filter, in the unit of ``noise``, which is the
        stated one of samples ``dt`` [s] apart."""
        share = 1.0 if self.is_filtered else filters.kept_variance(self.cut_off, dt)
        return noise * float(np.sqrt(share))

    def margin(self, dt: float) -> int:
        """Samples at either end of a record that the filter has spoiled."""
        return 0 if self.is_filtered else int(np.ceil(filters.SETTLED / (self.cut_off * dt)))

    def untouched(self, measured: np.ndarray, dt: float) -> np.ndarray:
        """Which samples (n,), ``dt`` [s] apart, are not spoiled by gaps, where ``measured`` (n,) is
        false."""
        if self.is_filtered:
            return measured
        period = 1.0 / (self.cut_off * dt)
        # Within a quarter of the shortest wave a straight line follows it, and a longer one is
        # felt by the filter a wave beyond its ends.
        long = binary_opening(~measured, np.ones(int(0.25 * period) + 1))
        return measured & ~binary_dilation(long, iterations=int(np.ceil(period)))


class RunForce:
    """The contact force of a pantograph of a run, as a function of place.

    Parameters
    ----------
    position : (n,) ascending [m]
    force : (n,) unfiltered [N]
    dt : time step [s]
    """

    def __init__(self, position: np.ndarray, force: np.ndarray, dt: float) -> None:
        self.position, self.dt = position, dt
        self._force = force
        self._known: dict[tuple[float | None, ...], CubicSpline] = {}

    @property
    def speed(self) -> float:
        """Mean speed [m/s]."""
        return float(self.position[-1] - self.position[0]) / (self.dt * (len(self.position) - 1))

    def below(self, *cut_offs: float | None) -> CubicSpline:
        """The force that has passed filters with these cut-offs [Hz]; None for none."""
        if cut_offs not in self._known:
            values = self._force
            for cut_off in cut_offs:
                # Nothing of a record is faster than half its sampling.
                if cut_off is not None and 2.0 * cut_off * self.dt < 1.0:
                    values = filters.low_pass(values, self.dt, cut_off)
            self._known[cut_offs] = CubicSpline(self.position, values)
        return self._known[cut_offs]
