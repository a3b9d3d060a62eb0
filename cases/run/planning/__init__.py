"""Planning a run: what it simulates, its size, and what it needs of time, memory and disk."""
