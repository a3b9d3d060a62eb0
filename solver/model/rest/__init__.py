"""The line at rest as arrays, vertical and lateral."""
