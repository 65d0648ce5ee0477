"""Certified references of general loading programs: Taylor series in extended precision, by two formulations.

Both are regular through the instability, since their independent variable s is not time: dT = D ds, with D the
stiffness that vanishes there. Formulation A has the states T, w = 1/lambda and r = xi**2 and D = 8 B w**6 + 3 sigma w -
2 A; formulation B has T, lambda and xi, the paper's (23), (24) and (26), and the derivative of the load by the stretch
as its D. Neither solves the equation of equilibrium on the way, and neither has any code in common with the kernels.

python tests/reference/loading.py            the table anew (needs heyoka and mpmath)
python tests/reference/loading.py --check 10 as many of its rows computed again and compared
"""

import math
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from mpmath import MPContext
from table import read_hashed, write_hashed

PATH = Path(__file__).resolve().parent / "loading.csv"
SEED = 20110608
COLUMNS = (
    "program",
    "modulus_ratio",
    "prestretch",
    "a",
    "b",
    "c",
    "d",
    "outcome",
    "time_to_failure",
    "critical_stretch",
    "critical_internal_stretch",
    "critical_field",
    "final_stretch",
    "cycles_to_failure",
    "agreement",
    "kind",
)
SURVIVES, FAILS_LATER, FAILS_AT_ONCE = range(3)
REQUIRED = 2e-13  # relative difference of the two formulations, at most
CYCLES = 400  # after which a film is no point of the table

mp = MPContext()
mp.dps = 30
Real = np.longdouble
E_C = Real(mp.nstr(mp.mpf(3) / 4 * mp.mpf(4) ** (-mp.mpf(1) / 3), 25))

# A piece: field at its start, slope, amplitude and period of a sine, duration.
Piece = tuple[float, float, float, float, float]


def linear(start: float, end: float, duration: float) -> Piece:
    """Return a piece that goes from one field to another."""
    return start, (end - start) / duration if duration else 0.0, 0.0, 1.0, duration


#: Pieces of a program from its parameters a, b, c, d, and whether it is repeated without end.
PROGRAMS = {
    "pulse": (lambda field, width: [linear(field, field, width), linear(0, 0, 0)], False),
    "trapezoid": (
        lambda field, rise, hold, fall: [
            linear(0, field, rise),
            linear(field, field, hold),
            linear(field, 0, fall),
        ],
        False,
    ),
    "overdrive": (lambda over, time, field: [linear(over, over, time), linear(field, field, 0)], False),
    "pulse_train": (
        lambda field, on, off: [linear(field, field, on), linear(0, 0, off)],
        True,
    ),
    "triangle_train": (lambda field, half: [linear(0, field, half), linear(field, 0, half)], True),
    "biased_sine": (lambda bias, amplitude, period: [(bias, 0.0, amplitude, period, period)], True),
    "waveform": (
        lambda field, a, b, c: [
            linear(0, field, a),
            linear(field, -0.5 * field, b),
            linear(-0.5 * field, -field, c),
            linear(-field, 0.8 * field, a),
            linear(0.8 * field, 0.8 * field, 0),
        ],
        False,
    ),
    "ratchet": (
        lambda field, rise, hold, fall: [
            linear(0.6 * field, field, rise),
            linear(field, field, hold),
            linear(field, 0.6 * field, fall),
        ],
        True,
    ),
}

#: Pieces of the first repetition, of a program whose others begin at another field than zero.
FIRST = {
    "ratchet": lambda field, rise, hold, fall: [
        linear(0, field, rise),
        linear(field, field, hold),
        linear(field, 0.6 * field, fall),
    ],
}


def constants(x, r_or_xi, p, squared):
    """Return A and B."""
    r = r_or_xi if squared else r_or_xi * r_or_xi
    return 1 + p / r, 1 + p * r * r


@cache
def integrator(formulation: str):
    """Return the Taylor integrator with events at D = 0, then at the end of the piece.

    Its parameters: p, sigma, start, slope, amplitude, 2 pi/period, end.
    """
    import heyoka as hy

    t, x, y = hy.make_vars("t", "x", "y")
    p, sigma, start, slope, amplitude, turn, end = (hy.par[k] for k in range(7))
    field = start + slope * t + amplitude * hy.sin(turn * t)
    load_rate = 2 * float(1) * _e_c(hy) * field * (slope + amplitude * turn * hy.cos(turn * t))
    if formulation == "A":
        A, B = 1 + p / y, 1 + p * y * y
        u = x * x
        D = 8 * B * u * u * u + 3 * sigma * x - 2 * A
        flow = 2 / (y * u) - 2 * y * y * u * u
        load_of_r = -p * u / (y * y) - 2 * p * y * u * u * u * u
        system = [(t, D), (x, -(load_rate - load_of_r * flow) / x), (y, flow * D)]
    else:
        squared = y * y
        A, B = 1 + p / squared, 1 + p * squared * squared
        # de/dlambda, positive before the instability
        D = -2 * A * x**-3.0 + 8 * B * x**-9.0 + 3 * sigma * x**-4.0
        flow = x * x * y**-3.0 - x**-4.0 * y * y * y
        load_of_xi = -2 * p * y**-3.0 * x**-2.0 - 4 * p * y * y * y * x**-8.0
        system = [(t, D), (x, load_rate - load_of_xi * flow), (y, flow * D)]
    events = [
        hy.t_event(D, fp_type=Real, direction=hy.event_direction.negative),
        hy.t_event(t - end, fp_type=Real, direction=hy.event_direction.positive),
    ]
    zeros = [Real(0), Real(1), Real(1)]
    return hy.taylor_adaptive(system, zeros, fp_type=Real, t_events=events, pars=[Real(1)] * 7, compact_mode=True)


def _e_c(hy):
    return hy.expression(E_C)


def unknown(r: Real, p: Real, sigma: Real, field: Real) -> tuple[Real, Real]:
    """Return w in equilibrium (NaN where the film does not carry the field) and w at D = 0."""
    A, B, e = mp.mpf(1) + _mp(p) / _mp(r), 1 + _mp(p) * _mp(r) ** 2, _mp(E_C) * _mp(field) ** 2
    s = _mp(sigma)
    w = (A / B) ** (mp.mpf(1) / 6)
    low = w
    for _ in range(200):
        change = (8 * B * low**6 + 3 * s * low - 2 * A) / (48 * B * low**5 + 3 * s)
        low -= change
        if abs(change) < 1e-27:
            break
    if A * low**2 - B * low**8 - s * low**3 < e:
        return Real("nan"), _real(low)
    for _ in range(200):
        change = (A * w**2 - B * w**8 - s * w**3 - e) / (w * (8 * B * w**6 + 3 * s * w - 2 * A) + mp.mpf(10) ** -40)
        w += change
        if abs(change) < 1e-27:
            break
    return _real(w), _real(low)


def _mp(x):
    return mp.mpf(np.format_float_positional(x, unique=True, trim="0")) if isinstance(x, Real) else mp.mpf(x)


def _real(x):
    return Real(mp.nstr(x, 25))


def passage(formulation, pieces, r, p, sigma):
    """Go through the pieces: whether the film fails, the time, r and E/Ec there, or at the end."""
    time = Real(0)
    for start, slope, amplitude, period, duration in pieces:
        begin = Real(start)
        w, critical = unknown(r, p, sigma, begin)
        if np.isnan(w):
            u = _mp(critical)
            carried = (1 + _mp(p) / _mp(r)) * u**2 - (1 + _mp(p) * _mp(r) ** 2) * u**8 - _mp(sigma) * u**3
            return True, time, r, _real(mp.sqrt(carried / _mp(E_C)))
        if not duration:
            continue
        ta = integrator(formulation)
        ta.time = Real(0)
        ta.state[:] = [Real(0), w, r] if formulation == "A" else [Real(0), 1 / w, np.sqrt(r)]
        turn = 2 * Real("3.14159265358979323846264") / Real(period)
        ta.pars[:] = [p, sigma, begin, Real(slope), Real(amplitude), turn, Real(duration)]
        ta.reset_cooldowns()
        met = ta.propagate_until(Real(1e12))[0]
        t, _, y = ta.state
        r = y if formulation == "A" else y * y
        if int(met) == -1:
            return True, time + t, r, abs(begin + Real(slope) * t + Real(amplitude) * np.sin(turn * t))
        if int(met) != -2:
            raise ArithmeticError(f"{formulation}: {met}")
        time += Real(duration)
    return False, time, r, None


def end_field(piece: Piece) -> float:
    """Return the field at the end of a piece."""
    return piece[0] + piece[1] * piece[4]


def solve(formulation, pieces, repeated, m, prestretch, first=None):
    """Return outcome, time, r, field, final stretch, cycles of a program; None where it takes too many cycles."""
    p, pre = Real(m) - 1, Real(prestretch)
    sigma = Real(prestretch - prestretch**-5)
    r = pre * pre
    if not repeated:
        failed, time, r, field = passage(formulation, pieces, r, p, sigma)
        if failed:
            return (FAILS_AT_ONCE if time == 0 else FAILS_LATER), time, r, field, None, None
        held = end_field(pieces[-1])
        stable, unstable = relaxed(held, sigma)
        if stable is not None and r <= unstable**2:
            return SURVIVES, None, None, None, stable, None
        failed, more, r, field = passage(formulation, [linear(held, held, 1e9)], r, p, sigma)
        return FAILS_LATER, time + more, r, field, None, None
    total, earlier = Real(0), r
    for cycle in range(CYCLES):
        before = r
        failed, time, r, field = passage(formulation, pieces if cycle or not first else first, r, p, sigma)
        if failed:
            outcome = FAILS_AT_ONCE if time + total == 0 else FAILS_LATER
            return outcome, total + time, r, field, None, cycle
        total += time
        if (cycle or not first) and r - before <= 1e-15 * r:
            return SURVIVES, None, None, None, None, None
        if cycle % 20 == 19:
            # Certificate: the map of a cycle is increasing; no film gets past an r1 that comes back no larger.
            ratio = (r - before) / (before - earlier)
            if ratio < 1:
                ahead = r + 1.3 * (r - before) * ratio / (1 - ratio)
                failed, _, back, _ = passage(formulation, pieces, ahead, p, sigma)
                if not failed and back <= ahead:
                    return SURVIVES, None, None, None, None, None
        earlier = before
    return None


def relaxed(field: float, sigma: Real):
    """Return the stretches of the relaxed film under a held field, stable and unstable; None where there is none."""
    s, e = _mp(sigma), _mp(E_C) * _mp(field) ** 2
    w, top = unknown(Real(1), Real(0), sigma, Real(field))
    if np.isnan(w):
        return None, None
    low, high = mp.mpf(0), _mp(top)
    for _ in range(110):
        middle = (low + high) / 2
        low, high = (middle, high) if middle**2 - middle**8 - s * middle**3 < e else (low, middle)
    return 1 / w, (Real("inf") if field == 0 else _real(1 / low))


def certify(program: str, m: float, prestretch: float, arguments: tuple[float, ...]):
    """Return the row of a point, or None where it is not certified or takes too many cycles."""
    make, repeated = PROGRAMS[program]
    pieces = make(*arguments)
    first = FIRST[program](*arguments) if program in FIRST else None
    found = [solve(formulation, pieces, repeated, m, prestretch, first) for formulation in "AB"]
    if None in found or found[0][0] != found[1][0] or found[0][5] != found[1][5]:
        return None
    a, b = found
    difference = max(
        (abs(float(x / y - 1)) for x, y in zip(a[1:5], b[1:5], strict=True) if x is not None and y != 0), default=0.0
    )
    if difference > REQUIRED:
        return None
    outcome, time, r, field, final, cycles = a
    row = {"program": program, "modulus_ratio": repr(m), "prestretch": repr(prestretch), "outcome": str(outcome)}
    row |= {name: repr(value) for name, value in zip("abcd", arguments, strict=False)}
    if outcome != SURVIVES:
        critical = unknown(r, Real(m) - 1, Real(prestretch - prestretch**-5), Real(0))[1]
        row |= {
            "time_to_failure": _text(time),
            "critical_stretch": _text(1 / critical),
            "critical_internal_stretch": _text(np.sqrt(r)),
            "critical_field": _text(field),
        }
        if cycles is not None and outcome == FAILS_LATER:
            row["cycles_to_failure"] = str(cycles)
    if final is not None:
        row["final_stretch"] = _text(final)
    row["agreement"] = f"{difference:.1e}"
    return row


def _text(x) -> str:
    return np.format_float_scientific(x, 17, unique=False, trim="-")


def threshold(program: str, m: float, prestretch: float, scaled) -> float | None:
    """Return the factor of the fields between survival and failure, to 1e-9, by formulation A."""
    make, repeated = PROGRAMS[program]
    low, high = 0.2, 2.0 * math.sqrt(m)
    while high - low > 1e-9 * low:
        middle = 0.5 * (low + high)
        first = FIRST[program](*scaled(middle)) if program in FIRST else None
        found = solve("A", make(*scaled(middle)), repeated, m, prestretch, first)
        if found is None:  # too many cycles: beside a tangent
            return middle if high - low < 1e-3 * low else None
        low, high = (middle, high) if found[0] == SURVIVES else (low, middle)
    return low


def points(program: str) -> Iterator[tuple[str, float, float, tuple[float, ...]]]:
    """Yield kind, modulus ratio, pre-stretch and arguments: beside thresholds and far from them."""
    random = np.random.default_rng([SEED, *program.encode()])
    while True:
        m = float(np.exp(random.uniform(math.log(1.2), math.log(40.0))))
        prestretch = 1.0 if random.random() < 0.7 else float(random.uniform(1.05, 3.5))
        times = [float(x) for x in 10 ** random.uniform(-1.3, 1.0, 3)]
        share = float(random.uniform(0.6, 1.0))

        def scaled(factor, times=times, share=share):
            if program == "overdrive":
                return factor, times[0], share * factor
            if program == "biased_sine":
                return share * factor, (1.3 - share) * factor, times[0]
            arguments = {"pulse": 1, "triangle_train": 1, "pulse_train": 2}.get(program, 3)
            return (factor, *times[:arguments])

        at = threshold(program, m, prestretch, scaled)
        gaps = (-0.3, -0.03, 0.03, 0.2) if at is None else (-0.1, -1e-3, -1e-6, 1e-6, 1e-4, 1e-2, 0.2)
        for gap in gaps:
            kind = "apart" if abs(gap) >= 1e-2 else "beside_threshold"
            yield kind, m, prestretch, scaled((at or 1.0 / prestretch) * (1.0 + gap))


def far_points(program: str) -> Iterator[tuple[str, float, float, tuple[float, ...]]]:
    """Yield points of the whole region: modulus ratios to 1000, pre-stretches to 6, short and long times."""
    random = np.random.default_rng([SEED + 1, *program.encode()])
    while True:
        m = float(np.exp(random.uniform(0.0, math.log(1000.0))))
        prestretch = 1.0 if random.random() < 0.5 else float(random.uniform(1.0, 6.0))
        times = [float(x) for x in 10 ** random.uniform(-4.0, 3.0, 3)]
        share = float(random.uniform(0.5, 1.0))
        p, r, sigma = Real(m) - 1, Real(prestretch) ** 2, Real(prestretch - prestretch**-5)
        relaxed, instant = (float(carried_field(r, ratio, sigma)) for ratio in (Real(0), p))
        field = relaxed * (1.3 * max(instant / relaxed, 1.0)) ** float(random.uniform(-0.05, 1.0))
        if program == "overdrive":
            yield "far", m, prestretch, (field, times[0], share * field)
        elif program == "biased_sine":
            yield "far", m, prestretch, (share * field, (1.3 - share) * field, times[0])
        else:
            yield (
                "far",
                m,
                prestretch,
                (field, *times[: {"pulse": 1, "triangle_train": 1, "pulse_train": 2}.get(program, 3)]),
            )


#: Films that fail late while the field falls, next to a folded singularity: modulus ratio, pre-stretch, arguments.
FALLING = {
    "trapezoid": (
        (
            539.5532406804896,
            2.385265670091909,
            (0.7666412306081907, 0.0008711046585130645, 0.6691914758326494, 548.8461072263905),
        ),
        (137.95207323321503, 1.0, (2.0039561069482317, 0.03930914699119552, 0.0011981312032004461, 145.54874624622673)),
        (591.774869964684, 1.0, (2.5112524426162275, 0.04268989766653612, 2.0294494657773687, 347.2513122917194)),
        (671.5452556518181, 1.0, (2.7347631289459593, 48.27410251423178, 0.53386476330136, 272.10910495821673)),
        (285.9200219607889, 1.0, (2.940242635769079, 0.024970204601701972, 0.05662835246382257, 113.5563419073802)),
    ),
    "biased_sine": (
        (116.4157226948312, 1.0, (1.507820206492456, 6.847469956258795, 1.611449403189927)),
        (15.470858790191812, 1.0, (1.2402578125059425, 1.8448831753197104, 1.4233966635402682)),
        (251.0607874739434, 1.0, (0.6079495183305957, 0.9349755513939486, 512.5807953199326)),
    ),
}


def carried_field(r: Real, p: Real, sigma: Real) -> Real:
    """Return the largest field that a film carries."""
    w = _mp(unknown(r, p, sigma, Real(0))[1])
    return _real(
        mp.sqrt(((1 + _mp(p) / _mp(r)) * w**2 - (1 + _mp(p) * _mp(r) ** 2) * w**8 - _mp(sigma) * w**3) / _mp(E_C))
    )


def generate() -> None:
    """Compute the table and write it."""
    rows = []
    for program in PROGRAMS:
        mine = []
        for wanted, source in ((63, points), (85, far_points)):
            for kind, m, prestretch, arguments in source(program):
                row = certify(program, m, prestretch, arguments)
                if row is not None:
                    mine.append(row | {"kind": kind})
                if len(mine) == wanted:
                    break
        mine += [certify(program, *point) | {"kind": "falling"} for point in FALLING.get(program, ())]
        print(program, len(mine), file=sys.stderr, flush=True)
        rows += mine
    write(rows)


def write(rows: list[dict[str, str]]) -> None:
    """Write the table."""
    lines = [",".join(COLUMNS)] + [",".join(row.get(name, "") for name in COLUMNS) for row in rows]
    notes = [
        f"dea_maps reference: {len(rows)} films under general loading programs, certified by two formulations",
        "made by: python tests/reference/loading.py; the programs' arguments a to d are those of PROGRAMS there",
        f"extended precision; agreement: relative difference of the formulations, at most {REQUIRED}",
    ]
    write_hashed(PATH, notes, "\n".join(lines) + "\n")


def read() -> list[dict[str, str]]:
    """Return the rows of the table as text; ValueError if they do not match the hash."""
    return read_hashed(PATH)


def confirmed(stored: dict[str, str]) -> bool:
    """Compute a row again; whether it is what is stored."""
    arguments = tuple(float(stored[name]) for name in "abcd" if stored[name])
    row = certify(stored["program"], float(stored["modulus_ratio"]), float(stored["prestretch"]), arguments)
    if row is None or row["outcome"] != stored["outcome"]:
        return False
    numbers = COLUMNS[8:14]
    return all(
        not stored[name] or abs(float(row[name]) - float(stored[name])) <= REQUIRED * abs(float(stored[name]))
        for name in numbers
    )


def main() -> int:
    """Run the command line."""
    if "--check" not in sys.argv:
        generate()
        return 0
    rows = read()
    count = int(sys.argv[sys.argv.index("--check") + 1])
    differing = [row for row in rows[:: max(1, len(rows) // count)] if not confirmed(row)]
    for row in differing:
        print("not confirmed:", row)
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
