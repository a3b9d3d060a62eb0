"""Sets of scenes of one case, evaluated together: directions, speeds, trains, errors."""
