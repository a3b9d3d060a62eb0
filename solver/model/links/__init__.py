"""Links between unknowns: droppers, clamps, arms, stops, and droppers that lean."""
