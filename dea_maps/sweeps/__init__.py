"""Sweeps in memory: parameters, grids, methods, the solving of cells, data sets."""
