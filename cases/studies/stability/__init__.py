"""Stability limits of each coupling of line and pantograph."""
