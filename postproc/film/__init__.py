"""A film of a run: the moving line and its pantographs, the contact force beneath."""
