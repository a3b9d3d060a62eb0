"""The line advanced in time: Newmark's family, a step in two passes."""
