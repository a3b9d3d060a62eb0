"""The rest that a line comes to after a change: cut droppers, temperature, wind, incidents."""
