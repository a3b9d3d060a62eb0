"""A film of a run: the moving line and its pantographs from the side, the contact force beneath."""
