"""Wind along a line: its mean, its gusts in space and time, and what it does to wires."""
