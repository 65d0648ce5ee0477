"""General loading programs, with or without a dead load: one compiled kernel for every program.

A program is a table of pieces that all cells share. Each argument of a piece is ``scale * columns[source]``, a number
per cell; ``columns[0]`` holds ones, so that a constant is ``scale * 1``. Times are in relaxation times and count from
the start of the piece, fields in Ec; negative fields are served, the load goes with the square.

    kind (pieces,) int8      LINEAR = 0, SINE = 1
    scale (pieces, 4) float64, source (pieces, 4) int64
        LINEAR: field at the start, field at the end, duration, unused: holds (equal fields) and jumps (a start that
                differs from the end before it, or from zero at t = 0) included; a duration of zero is a jump
        SINE:   mean, amplitude, duration, period: mean + amplitude*sin(2 pi t/period)
    columns (columns, cells) float64
    repeats int64            ENDLESS = -1, or how many times (>= 1); after the last the last field is held without end
    once int64               pieces that make up the first repetition, where that is not like the others, which are the
                             pieces after them; else 0
    modulus_ratio (cells,)   mu_U/mu_R >= 1
    start_stretch (cells,)   internal stretch at t = 0: 1, or the pre-stretch
    dead_load (cells,)       sigma = s/mu_R >= 0
    tolerance float64        relative error of time to failure, critical stretch and critical field

    from dea_maps.kernels.loading import build
    sweep = build.sweep(sine, dead_load)              two booleans: whether any piece is a SINE, any dead load not zero
    sweep(kind, scale, source, columns, repeats, once, modulus_ratio, start_stretch, dead_load, tolerance,
          status, result)

fills ``status`` (cells,) int8, with the codes of `lanes`: FAILED, FAILS_AT_ONCE, SURVIVES, any other one is unresolved;
and ``result`` (RESULTS, cells) float64, NaN where a row has no value for the outcome:

    TIME_TO_FAILURE, CRITICAL_STRETCH, CRITICAL_INTERNAL_STRETCH, CRITICAL_FIELD, FINAL_STRETCH, LARGEST_STRETCH,
    CYCLES_TO_FAILURE, STEADY_STRETCH_MAX, STEADY_STRETCH_MIN = range(RESULTS)          (in `loading.results`)

    trajectory = build.trajectory(sine, dead_load)
    trajectory(kind, scale, source, columns, repeats, once, modulus_ratio, start_stretch, dead_load, tolerance, times,
               wanted, stretch, internal_stretch)

fills (cells, times) arrays at ``times`` (cells, times), ascending, >= 0, the first ``wanted`` (cells,) of each cell,
which are before its failure; NaN elsewhere, and where the film fails before. All arrays are C-contiguous.
Results of a cell depend on its own columns alone.

    stepped = build.stepped(formulation, method)      "time" or "rate", a tableau: for comparison, see `stepped`
"""
