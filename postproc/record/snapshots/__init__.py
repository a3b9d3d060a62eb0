"""Snapshots of the moving line: its blocks, their fields, the files."""
