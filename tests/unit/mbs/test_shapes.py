"""Pantographs as lines: bodies keep their lengths, heads are where the record has them."""

from __future__ import annotations

import numpy as np
import pytest
from paper_pantograph import data as seven_bodies

from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.multibody_pantograph import stand
from catenary.mbs.shape import (
    BELOW_HEAD,
    BODY,
    HEAD,
    LOWER_ARM,
    SPRING,
    UPPER_ARM,
    schematic,
    shape_of,
)  # fmt: skip

THREE = LumpedData((6.0, 9.0, 5.8), (160.0, 15500.0, 7000.0), (100.0, 0.0, 70.0))


def test_lumped_masses_are_head_apex_and_knee_of_arms() -> None:
    shape = shape_of(THREE)
    pose = shape.pose(np.array([5.1, 5.06, 5.02]), 0.0, 5.1, 5.0)
    lifted = pose.now - pose.rest
    np.testing.assert_array_equal(lifted[:, :2], 0.0)
    points = {kind: np.unique(shape.cells[shape.kinds == kind]) for kind in (HEAD, BODY, SPRING)}
    np.testing.assert_allclose(pose.now[points[HEAD], 2], 5.1)
    # Apex with its two ends, knee, foot, and four corners of the base on the roof.
    np.testing.assert_allclose(lifted[points[BODY], 2], [0.06] * 3 + [0.02] + [0.0] * 5, atol=1e-12)
    springs = lifted[points[SPRING], 2]
    assert springs.max() == pytest.approx(0.1) and springs.min() == pytest.approx(0.06)
    assert pose.now[:, 2].min() == pytest.approx(5.0 - BELOW_HEAD)
    moved = shape.pose(np.array([5.1, 5.06, 5.02]), 0.01, 5.1, 5.0)
    assert (moved.now - pose.now)[:, 2].max() == pytest.approx(0.01), "a vehicle lifts the roof"
    assert shape.schematic


@pytest.mark.parametrize("masses", [1, 2, 3, 4])
def test_arms_of_lumped_masses_hang_together(masses: int) -> None:
    data = LumpedData((5.0,) * masses, (100.0,) * masses, (10.0,) * masses)
    shape = shape_of(data)
    pose = shape.pose(np.full(masses, 5.2), 0.2, 5.2, 5.0)
    np.testing.assert_allclose(pose.now - pose.rest, np.tile([0, 0, 0.2], (len(pose.now), 1)))
    apex, knee, foot = pose.rest[np.unique(shape.cells[shape.kinds == BODY])[[1, 3, 4]]]
    assert np.linalg.norm(apex - knee) == pytest.approx(UPPER_ARM)
    assert np.linalg.norm(knee - foot) == pytest.approx(LOWER_ARM)
    # The spring joins apex and head, also as both stand on each other where they are one mass.
    spring = pose.rest[np.unique(shape.cells[shape.kinds == SPRING])]
    np.testing.assert_allclose(spring[-1], apex)
    np.testing.assert_allclose(spring[0], [0.0, 0.0, 5.0])


def test_of_an_unknown_pantograph_only_the_head_moves_by_itself() -> None:
    pose = schematic().pose(np.zeros(0), 0.0, 5.1, 5.0)
    lifted = (pose.now - pose.rest)[:, 2]
    assert set(np.round(lifted, 9)) == {0.0, 0.05, 0.1}


def test_bodies_of_a_reduced_mechanism_keep_their_lengths() -> None:
    data = seven_bodies()
    shape, standing = shape_of(data), stand(data)
    zero = 3.0
    head = zero + standing.working_height + standing.head.offset
    bodies = shape.cells[shape.kinds == BODY]
    lengths, places = [], []
    for lifted in (-0.45, -0.2, 0.0, 0.13, 0.45):
        arm = np.array([head + lifted, head + lifted])
        pose = shape.pose(arm, zero, head + lifted - 0.01, head)
        np.testing.assert_allclose(
            pose.now[np.unique(shape.cells[shape.kinds == HEAD]), 2], head + lifted - 0.01, atol=0.2
        )
        ends = pose.now[bodies]
        lengths.append(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1))
        places.append(pose.now)
        at_rest = pose.rest[bodies]
        still = np.linalg.norm(at_rest[:, 0] - at_rest[:, 1], axis=1)
        np.testing.assert_allclose(lengths[-1], still, atol=2e-3)
    assert np.ptp(places, axis=0)[:, 2].max() > 0.8 > 0.2 < np.ptp(places, axis=0)[:, 0].max()
    # The place of a pantograph is that of its head.
    np.testing.assert_allclose(
        places[2][np.unique(shape.cells[shape.kinds == HEAD]), 0], 0.0, atol=0.5
    )


def test_all_bodies_are_where_the_loop_has_them() -> None:
    data = seven_bodies()
    shape, standing = shape_of(data), stand(data)
    motion = standing.motion
    head = 3.0 + standing.working_height + standing.head.offset
    places = np.concatenate([motion.position[:-1].ravel(), motion.parameters[:-1].ravel()])
    reduced = shape.pose(np.array([head, head]), 3.0, head, head)
    whole = shape.pose(places, 3.0, head, head)
    np.testing.assert_allclose(whole.now, reduced.now, atol=1e-9)
    # A body that is moved by itself takes its own points along.
    upper = motion.numbers["upper_arm"]
    places[3 * upper + 2] += 0.1
    moved = shape.pose(places, 3.0, head, head).now - whole.now
    np.testing.assert_allclose(np.unique(np.round(moved[:, 2], 12)), [0.0, 0.1])
