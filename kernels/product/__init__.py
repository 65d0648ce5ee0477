"""Product grids field x rate x modulus_ratio under a ramp and a hold: what many cells share is integrated once.

The time to failure after a hold is a series over the field, one for each (rate, modulus_ratio), `series.py`; where the
film fails under the field held depends on (field, modulus_ratio) alone, `holds.py`; a cell, `cells.py`, is a sum of
terms. The way in is `grid.py`.
"""
