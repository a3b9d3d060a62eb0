"""Parts of a line's matrices, put together by stretches."""

from __future__ import annotations

import numpy as np
import pytest
from small_lines import WHOLE, ac_simple_line, mesh_of, problem_of

from catenary.solver.model import matrices
from catenary.solver.statics.form_finding import find_form


@pytest.mark.parametrize("rows", [(0, None), (36, 400), (36, 36)])
def test_stretches_make_the_matrix_to_the_bit(
    rows: tuple[int, int | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, _ = find_form(problem_of(ac_simple_line(3), WHOLE), mesh_of(ac_simple_line(3), 3))
    width, n = model.numbering.width, model.n_dofs
    here = rows[0], n if rows[1] is None else rows[1]
    asked = model, here, (0, n), (1.0, 0.3, 0.2), 1.0, width
    whole = matrices.part_of(*asked)
    monkeypatch.setattr(matrices, "_STRETCH", 10 * width + 1)
    parts = matrices.part_of(*asked)
    assert parts.shape == whole.shape == (here[1] - here[0], n)
    assert parts.blocksize == whole.blocksize == (width, width)
    for name in ("data", "indices", "indptr"):
        assert np.array_equal(getattr(parts, name), getattr(whole, name)), name
