"""A run in ParaView by one command: pantographs, forces and masts beside the line, and a script."""
