"""Running a case, and planning it."""
