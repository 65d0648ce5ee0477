"""Formulations: right-hand sides, events and read-outs."""

from .fold import FOLD
from .rate import RATE

FORMULATIONS = {formulation.name: formulation for formulation in (RATE, FOLD)}
"""Those that a Runge-Kutta method integrates, by name."""
