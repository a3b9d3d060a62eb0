"""Texts and files from anybody, read within bounds; which faults they have."""
