"""Keys of what is not as it was meant to be: irregularities, defects."""
