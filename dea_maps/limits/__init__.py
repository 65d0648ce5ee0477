"""Limits of loading: electrical breakdown, and the largest field, rate or voltage that is survived."""
