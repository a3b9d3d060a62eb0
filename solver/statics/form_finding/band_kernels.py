"""The compiled loop that sums element matrices into a matrix in bands."""

from __future__ import annotations

from catenary.solver.base.kernels.compiled import compiled


@compiled
def add_elements(bands, reach, dofs, matrices, free, known, from_given):
    """Add ``matrices`` (n, m, m) of elements with unknowns ``dofs`` (n, m) to the general ``bands``
    of LAPACK, whose diagonal is row 2 ``reach``; of given unknowns, which are not ``free``, add the
    products with their ``known`` values to ``from_given`` in place of the column."""
    for e in range(dofs.shape[0]):
        for j in range(dofs.shape[1]):
            column = dofs[e, j]
            if free[column]:
                for i in range(dofs.shape[1]):
                    bands[2 * reach + dofs[e, i] - column, column] += matrices[e, i, j]
            else:
                for i in range(dofs.shape[1]):
                    from_given[dofs[e, i]] += matrices[e, i, j] * known[column]
