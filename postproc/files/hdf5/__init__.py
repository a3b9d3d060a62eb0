"""Attributes, arrays and growing tables in HDF5: checksums, chunks, blocks of rows."""
