"""Constant field: the time to failure as an integral."""
