"""Keys of the track beneath a line: curve, tunnels."""
