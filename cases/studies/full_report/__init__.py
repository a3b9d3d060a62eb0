"""The full report of a run: its data sheets, its line to scale, its worst places seen closely."""
