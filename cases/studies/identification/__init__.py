"""Identification: parameters of a case and their uncertainty from a measured contact force."""
