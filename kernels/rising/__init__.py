"""A rising field on the area-strain form: start, steps, control, events."""
