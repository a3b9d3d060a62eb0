"""Reading result files, valid or damaged."""
