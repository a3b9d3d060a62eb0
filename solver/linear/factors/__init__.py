"""The step operator factored by stations: elimination, and solves with its factors."""
