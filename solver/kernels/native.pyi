"""Kernels of the time loop, compiled from C++: what the extension offers, for type checkers."""
