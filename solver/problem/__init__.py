"""Everything that a run is made of, in SI units: data only."""
