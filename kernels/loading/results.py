"""Rows of the result of a sweep of a general loading program."""

(
    TIME_TO_FAILURE,
    CRITICAL_STRETCH,
    CRITICAL_INTERNAL_STRETCH,
    CRITICAL_FIELD,
    FINAL_STRETCH,
    LARGEST_STRETCH,
    CYCLES_TO_FAILURE,
    STEADY_STRETCH_MAX,
    STEADY_STRETCH_MIN,
) = range(9)
RESULTS = 9
