"""Sweeps to NetCDF files: planned, computed part by part, checked when read."""
