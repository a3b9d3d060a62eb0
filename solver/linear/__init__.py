"""Products with the line's matrices and solves with the step operator, on a rank and across."""
