"""The general model: unequal stretches, under stresses or stretches and field."""
