"""What compiled kernels share: decorators, the cache on disk, bound arguments, aligned arrays."""
