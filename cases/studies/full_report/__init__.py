"""The full report of a run: data sheets, line to scale, worst places seen closely, validation."""
