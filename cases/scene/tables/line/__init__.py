"""Keys of the line: wires, hardware, ends, mesh."""
