"""What studies are asked for: options of verbs and arguments of Python, declared once."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, inf, log10
from typing import TYPE_CHECKING, Annotated

from catenary.base.errors import InputError
from catenary.base.options import named

if TYPE_CHECKING:
    import numpy as np

# Speeds of a first division and distances at most, and bounds of both [km/h], [m].
MOST, _SPEEDS, _DISTANCES = 2000, (1.0, 1000.0), (1.0, 1000.0)
# Least distance of two speeds, which are whole multiples of a tenth of it [km/h], and of two
# distances [m].
_CLOSEST = 1e-3


@dataclass(frozen=True)
class Speeds:
    """Speeds that are marched.

    Parameters
    ----------
    slowest KM_H : Lowest speed [km/h].
    fastest KM_H : Highest speed [km/h].
    step KM_H : Step of the speeds that are run first [km/h].
    within KM_H : Bisect the speed to this accuracy [km/h].
    """

    slowest: Annotated[float, "--from"] = 200.0
    fastest: Annotated[float, "--to"] = 360.0
    step: Annotated[float, "--step"] = 10.0
    within: Annotated[float, "--within"] = 1.0

    def first(self) -> list[float]:
        """The even division, both ends in it.

        Raises
        ------
        InputError
            If the range is invalid, or the division too fine.
        """
        _refuse_no_range(self, ("slowest", "fastest"), "speeds", _SPEEDS, "km/h")
        step, within = named(self, "step"), named(self, "within")
        if not _CLOSEST <= self.within <= self.step < inf:
            raise InputError(
                f"{within} {self.within:g} {step} {self.step:g} is not possible: {within} is at "
                f"least {_CLOSEST:g} km/h and at most {step}"
            )
        count = ceil((self.fastest - self.slowest) / self.step - 1e-9) + 1
        if count > MOST:
            raise InputError(
                f"{step} {self.step:g} makes {count} speeds; at most {MOST} are allowed"
            )
        evenly = [round(self.slowest + number * self.step, 4) for number in range(count - 1)]
        return [*evenly, self.fastest]

    @property
    def form(self) -> str:
        """Format of a speed that tells it from the next one, half of ``within`` away or more."""
        return f".{max(1, ceil(-log10(0.5 * self.within)))}f"


@dataclass(frozen=True)
class Distances:
    """Distances that are marched.

    Parameters
    ----------
    nearest M : Shortest distance [m].
    farthest M : Longest distance [m].
    step M : Step between distances [m].
    """

    nearest: Annotated[float, "--from"] = 31.0
    farthest: Annotated[float, "--to"] = 400.0
    step: Annotated[float, "--step"] = 1.0

    def values(self) -> list[float]:
        """The distances, ascending.

        Raises
        ------
        InputError
            If the range is invalid, or the division too fine.
        """
        _refuse_no_range(self, ("nearest", "farthest"), "distances", _DISTANCES, "m")
        step = named(self, "step")
        if not _CLOSEST <= self.step < inf:
            raise InputError(
                f"{step} {self.step:g} is not possible: it is finite and at least {_CLOSEST:g} m"
            )
        length = self.farthest - self.nearest
        if length / self.step > MOST:
            raise InputError(f"{step} {self.step:g} makes more than {MOST} distances")
        count = floor(length / self.step + 1e-9) + 1
        return [round(self.nearest + number * self.step, 4) for number in range(count)]


@dataclass(frozen=True)
class Frequencies:
    """Frequencies of a response, and of the lumped model that is fitted to it.

    Parameters
    ----------
    low HZ : Lowest frequency.
    high HZ : Highest frequency.
    n_points N : Frequencies between them, geometric.
    fit_low HZ : Lowest frequency of the fit; below it the response is that of the lift.
    """

    low: Annotated[float, "--from"] = 0.1
    high: Annotated[float, "--to"] = 25.0
    n_points: Annotated[int, "--points"] = 250
    fit_low: Annotated[float, "--fit-from"] = 0.5

    def frequencies(self) -> np.ndarray:
        """Those of the table, shape (n_points,) [Hz]."""
        import numpy as np

        return np.geomspace(self.low, self.high, self.n_points)

    def checked(self) -> Frequencies:
        """Itself, unless it is none: then an InputError."""
        if not 0.0 < self.low < self.high <= 1e5:
            raise InputError(
                f"--from {self.low:g} --to {self.high:g}: frequencies must grow from above 0 to "
                "at most 1e5 Hz"
            )
        if not 2 <= self.n_points <= 1_000_000:
            raise InputError(f"--points {self.n_points} must be between 2 and 1000000")
        if not 0.0 < self.fit_low < self.high:
            raise InputError(
                f"--fit-from {self.fit_low:g} must be above 0 Hz and below --to {self.high:g}"
            )
        return self


@dataclass(frozen=True)
class Excited:
    """Settings of an excitation in place of a train; None for that of the scene or of its kind.

    Parameters
    ----------
    force : Moving force or pulse; the static force if absent.
    frequency : Frequency of a moving force; constant if absent.
    at : Place of a pulse or hammer; mid-line if absent.
    duration : Duration of a pulse (0.1 if absent) or hammer (0.02).
    impulse : Impulse of a hammer; 10 if absent.
    """

    force: Annotated[float | None, "--force-N"] = None
    frequency: Annotated[float | None, "--frequency-Hz"] = None
    at: Annotated[float | None, "--at-m"] = None
    duration: Annotated[float | None, "--duration-s"] = None
    impulse: Annotated[float | None, "--impulse-Ns"] = None


def _refuse_no_range(
    asked: Speeds | Distances,
    ends: tuple[str, str],
    what: str,
    bounds: tuple[float, float],
    unit: str,
) -> None:
    low, high = (getattr(asked, end) for end in ends)
    least, most = bounds
    if not least <= low < high <= most:
        raise InputError(
            f"{named(asked, ends[0])} {low:g} {named(asked, ends[1])} {high:g} is no range of "
            f"{what}: give two ascending {what} from {least:g} to {most:g} {unit}"
        )
