"""Materials in SI units: their constants, their files, their fits."""
