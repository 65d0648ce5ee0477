"""Grids that are products field x rate x modulus_ratio: what many cells share is integrated once.

A ramp depends on (rate, modulus_ratio) alone, `climbs.py`; the time to failure under the field held, as a function of the
stretch at the corner, on (field, modulus_ratio) alone, `holds.py`. Both become Chebyshev series, and a cell, `cells.py`, is
the sum of two of them.
"""
