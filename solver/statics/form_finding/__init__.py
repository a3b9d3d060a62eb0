"""Form finding: the rest of a line in the wanted profiles, in the vertical and lateral plane."""
