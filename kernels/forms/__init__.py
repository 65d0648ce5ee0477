"""Formulations: right-hand sides, events and read-outs."""
