"""Runge-Kutta methods for any formulation: tableaus, steps, control, events, integration loop."""
