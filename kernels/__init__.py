"""Compiled numerics: arrays of floats in, arrays of floats out."""
