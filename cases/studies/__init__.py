"""Studies of many runs: sweeps, accuracy, hard cases, stability, pantographs, the paper."""
