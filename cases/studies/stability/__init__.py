"""Where each coupling of line and pantograph is stable."""
