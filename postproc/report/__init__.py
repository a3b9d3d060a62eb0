"""Reports, summaries, tables and pictures."""
