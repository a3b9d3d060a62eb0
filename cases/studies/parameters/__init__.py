"""Parameters of a case: derivatives of statistics by them, their values from measurement."""
