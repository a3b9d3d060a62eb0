"""A run as a film, and in ParaView: the moving line and its pantographs, the contact force."""
