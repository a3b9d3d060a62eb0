"""Train and pantographs, one subject a file: their keys and their conversion to SI units."""
