"""The collection of hard cases, and the limits that they must keep."""
