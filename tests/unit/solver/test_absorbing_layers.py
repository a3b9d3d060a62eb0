"""Absorbing layers as matrices: where they stand, what they damp, and that others lack them."""

from __future__ import annotations

import numpy as np
from small_lines import HANGING, ac_simple_line, mesh_of, problem_of

from catenary.solver.effects.build_model import build
from catenary.solver.effects.shipped.motion_effects import layer_damping
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Fixed

N_SPANS = 5


def model_with(start: EndCondition, end: EndCondition) -> Model:
    line = ac_simple_line(N_SPANS)
    problem = problem_of(line, HANGING | {"absorbing_layers"}, ends=(start, end))
    mesh = mesh_of(line, 2)
    return build(problem, mesh, np.full(mesh.droppers.shape[0], 1.0))


def test_damping_grows_as_the_square_of_the_way_into_the_layer() -> None:
    x = np.array([-10.0, 0.0, 5.0, 10.0, 20.0])
    np.testing.assert_allclose(layer_damping(x, 0.0, 10.0, 4.0), [0, 0, 1, 4, 4])
    np.testing.assert_allclose(layer_damping(x, 10.0, 0.0, 4.0), [4, 4, 1, 0, 0])


def test_layers_damp_all_masses_of_their_spans_and_nothing_else() -> None:
    model = model_with(AbsorbingLayer(1, 3.0), AbsorbingLayer(2, 5.0))
    mass, damping = whole_matrix(model, mass=1.0), whole_matrix(model, damping=1.0)
    masts = model.problem.line.support_positions
    x = model.numbering.as_vector(model.mesh.points[:, :1], np.nan)
    rate = layer_damping(x, masts[1], masts[0], 3.0) + layer_damping(x, masts[3], masts[5], 5.0)
    free = np.setdiff1d(np.arange(model.n_dofs), model.constrained)
    ratio = damping.diagonal()[free] / mass.diagonal()[free]
    # An element damps by the value at its middle: off by the change over half an element.
    elements = np.diff(np.unique(model.mesh.points[:, 0])).max()
    slope = 2 * 5.0 / (masts[5] - masts[3])
    assert np.abs(ratio - rate[free]).max() < 0.75 * elements * slope
    inside = free[(x[free] > masts[1]) & (x[free] < masts[3])]
    assert not damping[inside].nnz or abs(damping[inside]).max() == 0.0
    assert np.abs(damping - damping.T).max() < 1e-12
    assert not model.damping_is_proportional


def test_lines_without_layers_have_no_trace_of_them() -> None:
    model = model_with(Fixed(), Fixed())
    assert "absorbing_layers" not in model.terms_of
    assert all(block.damping is None for block in model.blocks)
    assert model.damping_is_proportional
