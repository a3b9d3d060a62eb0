"""Kernels of the time loop, in C++: the extension ``native``, which ``make setup`` compiles."""
