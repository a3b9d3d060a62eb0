"""Error indicators of a run from its own record: how coarse are time step and mesh?

Neither needs a second run. The time indicator uses the computed force, the mesh
indicator at the shortest waves that the elements carry. docs/accuracy.md compares both with true
errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy import optimize, signal

from catenary.base.errors import InputError
from catenary.meshgen.slowest_wave import bends
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import evaluated_force
from catenary.postproc.files.facts import FACTS, WIRE
from catenary.postproc.read.results import Results
from catenary.solver.model import beam
from catenary.solver.problem.integrator_parameters import AVERAGE_ACCELERATION, Integration

# Time over which an error of phase grows [s]: on the line without damping, where waves run
# away from the pantograph, and at the pantograph itself, which no damping of the line shortens.
# Both are calibrated, once, on the shipped cases (docs/accuracy.md).
LINE_MEMORY, NEAR_MEMORY = 0.75, 0.025
# Beyond this phase an error no longer grows with it [rad].
_LARGEST_PHASE = 0.7
# Above this share of the deviation the time step decides what is found.
COARSE_STEP = 0.05
# A wave is resolved while its frequency on the mesh is wrong by less than this.
RESOLVED = 0.01
_WAVE_NUMBERS = 400
# Records longer than this are thinned before their spectrum is taken, to this rate at least [Hz].
_SPECTRUM, _SAMPLED_HZ = 100_000, 1000.0
# Of longer ones the spectrum is the mean over stretches of so many values, some minutes.
_STRETCH = 1 << 18
# Of fewer values there is no spectrum.
_FEWEST = 8
# Waves of two elements belong to the lower branch, whatever rounding says.
_ZONE = np.pi * (1.0 + 1e-9)
_NEEDED = (
    "contact_wire_stiffness_damping", "contact_wire_mass_damping", "newmark_beta", "newmark_gamma",
    "mass_weight", "force_weight", "longest_element", "contact_wire_tension",
    "contact_wire_bending_stiffness", "contact_wire_mass",
)  # fmt: skip
_EARLIER = (
    "The result file is of an earlier version of Catenary and lacks the facts that error "
    "indicators and remarks on settings need: for these run the case again."
)


@dataclass(frozen=True)
class Indicators:
    """Estimates of the discretisation errors of a run, from its record.

    Attributes
    ----------
    force_error : (n_pantographs,) estimated rms error below 20 Hz of the force history due to the
        time step [N], NaN where the record has no statistics
    relative_error : (n_pantographs,) the same over the force's standard deviation
    resolved_frequency : highest frequency of a wave on the contact wire that the elements carry
        with less than 1 % error in frequency [Hz]
    required_frequency : that elements have to carry, ``required_frequency`` of 20 Hz [Hz];
        infinite where the train is as fast as the wave; both NaN in files of earlier formats
    warnings : sentences, empty if the settings are fine enough
    """

    force_error: np.ndarray
    relative_error: np.ndarray
    resolved_frequency: float
    required_frequency: float
    warnings: tuple[str, ...]


class Method(NamedTuple):
    """Inputs of the time indicator: proportional damping of the contact wire, C = alpha K
    + beta M ([s], [1/s]), and the parameters of its integration."""

    alpha: float
    beta: float
    integration: Integration = AVERAGE_ACCELERATION


def indicate(results: Results) -> Indicators:
    """The indicators of a run, as far as its record goes. Not collective."""
    n = results.n_pantographs
    error, deviation = np.full(n, np.nan), np.full(n, np.nan)
    known = {name: results.facts_of_wires(name) for name in _NEEDED}
    if any(np.isnan(value) for values in known.values() for value in values.values()):
        return Indicators(error, error, np.nan, np.nan, (_EARLIER,))
    wires = _contact_wires(results)
    for p in range(n):
        try:
            filtered = evaluated_force(results, p)[1]
        except InputError:  # the statistics say so
            continue
        if filtered.size < _FEWEST:
            continue
        deviation[p] = filtered.std()
        # Of several contact wires the one that remembers longest.
        error[p] = max(step_error(filtered, results.dt, wire.method) for wire in wires)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = error / deviation
    # Of several contact wires the one whose mesh is nearest to being too coarse.
    resolved, required = min(
        ((wire.resolved, wire.required) for wire in wires), key=lambda pair: pair[0] / pair[1]
    )
    warnings = (*_step_warning(relative, results.dt), *_mesh_warning(resolved, required))
    return Indicators(error, relative, resolved, required, warnings)


def step_error(force: np.ndarray, dt: float, method: Method) -> float:
    """Estimated rms error of a force history due to the time step [N]. Not collective.

    The method moves what has the frequency w to w (1 - E (w dt)^2) and takes w D(w dt) from its
    rate of growth, D being a damping ratio. Each component of the force is wrong by the product of
    both with the time for which what caused it is remembered.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Filtered contact force in the evaluation stretch [N].
    dt : float
        Time step [s].
    method : Method
        Time integration of the run.
    """
    deviation = float(force.std())
    # A filtered record needs few samples; a long one has more than a spectrum can use.
    every = max(1, min(force.size // _SPECTRUM, int(1.0 / (_SAMPLED_HZ * dt))))
    omega, power = _spectrum(force[::every], every * dt)
    if deviation == 0.0 or power.sum() == 0.0:
        return 0.0
    power = power * deviation**2 / power.sum()
    own = method.integration
    shift = own.frequency_error * omega**3 * dt**2
    if own.is_second_order:
        decay = own.third_order_damping * omega**4 * dt**3
    else:
        decay = own.first_order_damping * omega**2 * dt
    phase = memory(omega, method.alpha, method.beta) * np.hypot(shift, decay)
    phase = np.minimum(phase, _LARGEST_PHASE)
    return float(np.sqrt(np.sum(power * (2.0 - 2.0 * np.cos(phase)))))


def _spectrum(values: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies [rad/s], without zero, and what each has of the power of values
    (n,) about their mean, under a Hann window; of a long record the mean over stretches."""
    stretch = min(values.size, _STRETCH)
    frequency, power = signal.welch(values, 1.0 / dt, nperseg=stretch, noverlap=0)
    return 2.0 * np.pi * frequency[1:], power[1:]


def memory(omega: np.ndarray, alpha: float, beta: float) -> np.ndarray:
    """Memory time of each component of the contact force, shape (n,) [s].

    A wave exp(i (w t - k x)) on a string with C = alpha K + beta M has
    k = (w / c) sqrt((1 - i beta / w) / (1 + i alpha w)). Over the length 1 / |Im k| on which it
    dies out, a change of w shifts its phase by |dk / dw| / |Im k|: that is the line's memory,
    never longer than ``LINE_MEMORY``.

    Parameters
    ----------
    omega : ndarray, shape (n,)
        Angular frequencies above zero [rad/s].
    alpha : float
        Stiffness-proportional damping [s].
    beta : float
        Mass-proportional damping [1/s].
    """
    number = omega * np.sqrt((1.0 - 1j * beta / omega) / (1.0 + 1j * alpha * omega))
    slope = number * (
        1.0 / omega
        + 0.5j * beta / omega**2 / (1.0 - 1j * beta / omega)
        - 0.5j * alpha / (1.0 + 1j * alpha * omega)
    )
    return np.asarray(NEAR_MEMORY + 1.0 / (1.0 / LINE_MEMORY + np.abs(number.imag) / np.abs(slope)))


def required_frequency(felt: float, speed: float, alpha: float) -> float:
    """Frequency of the undamped wave that is as long as the waves ahead of the train [Hz].

    A pantograph that moves with v and feels w_0 excites, ahead of itself, w = w_0 + v Re k; on a
    string with C = alpha K the wave number is k = (w / c) / sqrt(1 + i alpha w). Without damping
    that is w_0 / (1 - v / c); damping lets what dies out be longer, so that fewer elements carry
    it. What they have to carry is the length 2 pi / |k|.

    Parameters
    ----------
    felt : float
        Highest frequency that is felt at the pantograph [Hz].
    speed : float
        Speed of the train over that of the waves [-]; at 1 and above there is no such wave:
        infinite.
    alpha : float
        Damping on stiffness of the contact wire [s].
    """
    if speed >= 1.0:
        return float("inf")
    own = 2.0 * np.pi * felt

    def slowness(omega: float) -> complex:
        return complex(1.0 / np.sqrt(1.0 + 1j * alpha * omega))

    undamped = own / (1.0 - speed)
    omega = optimize.brentq(
        lambda w: w * (1.0 - speed * slowness(w).real) - own, own, undamped * (1.0 + 1e-9)
    )
    return float(omega * abs(slowness(omega)) / (2.0 * np.pi))


def required_by_bending(
    felt: float, speed: float, tension: float, bending_stiffness: float, mass_per_length: float
) -> float:
    """Frequency of the wave that runs ahead of the train on a wire whose bending carries it [Hz].

    A pantograph that moves with v and feels w_0 excites w = w_0 + v k, ahead of itself with
    w^2 = (F k^2 + EI k^4) / m: there is such a wave at every speed. Damping, which lets what dies
    out be longer, is left out.

    Parameters
    ----------
    felt : float
        Highest frequency that is felt at the pantograph [Hz].
    speed : float
        Speed of the train [m/s].
    tension, bending_stiffness, mass_per_length : float
        Tension, bending stiffness and mass per length of the wire [N], [N m2], [kg/m].
    """
    own = 2.0 * np.pi * felt
    roots = np.roots(
        [
            bending_stiffness / mass_per_length,
            0.0,
            tension / mass_per_length - speed**2,
            -2.0 * own * speed,
            -(own**2),
        ]
    )
    ahead = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    if not ahead.size:  # a damaged file without bending
        return float("inf")
    return float((own + speed * ahead.max()) / (2.0 * np.pi))


@lru_cache(maxsize=256)
def resolved_frequency(
    length: float, tension: float, bending_stiffness: float, mass_per_length: float
) -> float:
    """Highest frequency of a wave that elements carry with less than 1 % error [Hz].

    Free waves w_n = exp(i k n h) on an endless wire of equal elements against
    w^2 = (F k^2 + EI k^4) / m; the first wave number whose frequency is wrong ends the search,
    at most that of two waves an element.

    Parameters
    ----------
    length : float
        Length of an element [m].
    tension, bending_stiffness, mass_per_length : float
        Tension, bending stiffness and mass per length of the wire [N], [N m2], [kg/m].
    """
    h = np.array([length])
    stiffness = beam.stiffness(h, bending_stiffness, tension)[0]
    mass = beam.mass(h, mass_per_length)[0]
    numbers = np.linspace(0.0, 2.0 * np.pi / length, _WAVE_NUMBERS + 1)[1:]
    exact = np.sqrt((tension + bending_stiffness * numbers**2) / mass_per_length) * numbers
    # Both nodes of an element in terms of the first one's deflection and slope.
    shift = np.concatenate(
        [
            np.tile(np.eye(2), (numbers.size, 1, 1)),
            np.exp(1j * numbers * length)[:, None, None] * np.eye(2),
        ],
        axis=1,
    )
    turned = shift.conj().swapaxes(1, 2)
    root = np.linalg.inv(np.linalg.cholesky(turned @ mass @ shift))
    both = np.linalg.eigvalsh(root @ (turned @ stiffness @ shift) @ root.conj().swapaxes(1, 2))
    # Two waves share the nodes' motion; the longer one lies on the lower branch.
    square = np.where(numbers * length < _ZONE, both[:, 0], both[:, 1])
    wrong = np.abs(np.sqrt(np.maximum(square, 0.0)) / exact - 1.0) > RESOLVED
    carried = int(np.argmax(wrong)) if wrong.any() else numbers.size
    return float(exact[carried - 1] / (2.0 * np.pi)) if carried else 0.0


def as_table(indicators: Indicators) -> dict[str, Any]:
    """The content of ``indicators`` in ``summary.json``."""
    return {
        "time_step": {
            "force_error_N": indicators.force_error,
            "force_error_percent_of_std": 100.0 * indicators.relative_error,
            "limit_percent_of_std": 100.0 * COARSE_STEP,
        },
        "mesh": {
            "resolved_hz": indicators.resolved_frequency,
            "required_hz": indicators.required_frequency,
        },
        "warnings": list(indicators.warnings),
    }


class _ContactWire(NamedTuple):
    """Resolution of a contact wire: by its steps, by its longest element where it is evaluated, and
    as required [Hz]."""

    method: Method
    resolved: float
    required: float


def _contact_wires(results: Results) -> list[_ContactWire]:
    """The contact wires of a run."""
    names = [name for name, fact in FACTS.items() if fact.per == WIRE]
    facts = {name: results.facts_of_wires(name) for name in names}
    return [
        _contact_wire(results, {name: values[wire] for name, values in facts.items()})
        for wire in results.wires_of(Role.CONTACT)
    ]


def _contact_wire(results: Results, of_wire: Mapping[str, float]) -> _ContactWire:
    fact = results.fact
    alpha, tension = of_wire["contact_wire_stiffness_damping"], of_wire["contact_wire_tension"]
    mass = of_wire["contact_wire_mass"]
    weights = fact("mass_weight"), fact("force_weight")
    stiffness = of_wire["contact_wire_bending_stiffness"]
    if bends(fact("wave_speed"), tension, mass):
        required = required_by_bending(filters.CUT_OFF, fact("speed"), tension, stiffness, mass)
    else:
        required = required_frequency(
            filters.CUT_OFF, fact("speed") / np.sqrt(tension / mass), alpha
        )
    return _ContactWire(
        Method(
            alpha,
            of_wire["contact_wire_mass_damping"],
            Integration(fact("newmark_beta"), fact("newmark_gamma"), *weights),
        ),
        resolved_frequency(of_wire["longest_element"], tension, stiffness, mass),
        required,
    )


def _step_warning(relative: np.ndarray, dt: float) -> list[str]:
    known = relative[np.isfinite(relative)]
    if not known.size or known.max() <= COARSE_STEP:
        return []
    return [
        f"The time step of {1e3 * dt:g} ms is too coarse: it is estimated to change the force "
        f"history below 20 Hz by {100 * known.max():.0f} % of its standard deviation (rms). Take a "
        "smaller numerics.dt_s."
    ]


def _mesh_warning(resolved: float, required: float) -> list[str]:
    if resolved >= required:
        return []
    needs = (
        f"20 Hz at the pantograph excite waves ahead as short as those of {required:.0f} Hz"
        if np.isfinite(required)
        else "the train is as fast as the waves, which no mesh resolves"
    )
    return [
        f"The longest elements of the contact wire carry waves of up to {resolved:.0f} Hz with "
        f"less than 1 % error, but {needs}. Take a larger mesh.elements_per_gap."
    ]
