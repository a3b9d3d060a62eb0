"""Chains whose base spring holds them at a height: raised with their base, by parts of the lift."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.cases.run.description import description_of
from catenary.mbs.head.stepping import Lowering, Stepping
from catenary.mbs.interface import drive_width
from catenary.mbs.lumped import READY, LumpedData, LumpedPantograph

TIED = LumpedData((10.31, 6.15, 15.30), (53415.8, 6754.2, 40687.0), (29.6, 0.2, 1.14))
FORCE, NOMINAL, PLACED, RAISE, DT = 110.0, 5.0, 4.99, 0.5, 1e-3
EPS = np.finfo(float).eps


def held(part: float) -> float:
    """Force at rest on a head that is held at its nominal height, with a part of the lift and its
    base where that puts it: springs in a row under the lift on the last mass [N]."""
    base = PLACED + part * (NOMINAL + FORCE * TIED.compliance - PLACED)
    k, above = TIED.stiffnesses[-1], 1.0 / TIED.compliance
    last = (part * FORCE + k * base + above * NOMINAL) / (k + above)
    return above * (last - NOMINAL)


def pantograph(raise_time: float = RAISE) -> LumpedPantograph:
    made = LumpedPantograph(TIED, FORCE, NOMINAL, Stepping(raise_time, DT))
    made.place(PLACED)
    return made


def test_ready_chains_are_not_tied() -> None:
    assert TIED.tied
    assert not any(ready.chain.tied for ready in READY.values())


def test_a_tied_chain_starts_at_rest() -> None:
    """Nothing pulls at its masses before the lift grows, wherever it is placed."""
    round_off = 40 * EPS * 53415.8 * PLACED / min(TIED.masses)
    # The rate of the base at the start is a one-sided difference over 10 us: half of (pi / 0.5)^2
    # 1e-5 times 28 mm a second, on a damper of 1.14 N s/m.
    late = 0.25 * (np.pi / RAISE) ** 2 * 1e-5 * 0.029 * TIED.dampings[-1] / TIED.masses[-1]
    assert pantograph().state()[6:] == pytest.approx(0.0, abs=round_off + late)


def test_a_tied_chain_comes_to_the_static_force_at_its_nominal_height() -> None:
    """Held by a stiff contact there: F = part F_s when all of the lift acts."""
    assert held(1.0) == pytest.approx(FORCE, rel=1e-9)
    # Without its rise the base would push from the start with 745 N against the last mass.
    assert TIED.stiffnesses[-1] * FORCE * TIED.compliance == pytest.approx(746.3, abs=0.5)


def test_drives_of_many_steps_are_those_of_single_ones() -> None:
    one = pantograph()
    times = np.array([0.1, 0.25, 0.4, 0.5, 0.7])
    drives = np.zeros((len(times), drive_width(1)))
    one.fill_drives(times, drives)
    for time, row in zip(times.tolist(), drives, strict=True):
        other = pantograph()
        other.predict(time)
        assert row == pytest.approx(other.row, rel=1e-12)


def test_the_base_rises_by_the_half_cosine_of_the_lift() -> None:
    """Place and rate against the derivative of the half cosine."""
    one = pantograph()
    way = NOMINAL + FORCE * TIED.compliance - PLACED
    time = np.array([0.0, 0.1, 0.25, 0.4, 0.6])
    place, rate = one._rise(time)
    inside = time < RAISE
    part = np.where(inside, 0.5 * (1.0 - np.cos(np.pi * time / RAISE)), 1.0)
    slope = np.where(inside, 0.5 * np.pi / RAISE * np.sin(np.pi * time / RAISE), 0.0)
    assert place == pytest.approx(way * (part - 1.0), abs=1e-12)
    # The difference over 20 us is off by (pi 1e-5 / 0.5)^2 / 6 = 7e-10; it is one-sided at the
    # start, off by 0.25 (pi / 0.5)^2 1e-5 = 1e-4.
    assert rate == pytest.approx(way * slope, abs=1e-4 * abs(way))


def test_a_lowered_chain_goes_down_with_its_base() -> None:
    """With a fifth of the lift left a fifth of the force is."""
    one = pantograph()
    one.follow(Lowering(1.0, 0.2 * FORCE, 0.3, 0.5).course(FORCE, RAISE))
    (place,), (rate,) = one._rise(np.array([2.0]))
    way = NOMINAL + FORCE * TIED.compliance - PLACED
    assert place == pytest.approx(-0.8 * way, rel=1e-12) and rate == pytest.approx(0.0, abs=1e-12)
    # The base is below its place by as much as it was placed below the nominal height.
    less = 0.8 * (NOMINAL - PLACED) * TIED.height_stiffness
    assert held(0.2) == pytest.approx(0.2 * FORCE - less, rel=1e-9)


def test_a_tied_chain_says_by_how_much_its_force_depends_on_the_height() -> None:
    """1 / (1 / 53415.8 + 1 / 6754.2 + 1 / 40687) = 5.229 N/mm."""
    assert description_of(TIED, FORCE).endswith(
        "110.0 N; tied to its base: its force falls by 5.23 N with each mm that its head rises"
    )
    soft = LumpedData(TIED.masses, (*TIED.stiffnesses[:-1], 160.0), TIED.dampings)
    assert "tied" not in description_of(soft, FORCE)
