"""Certified references of films under a dead load: step, ramp and ramp-and-hold, each by two formulations.

A step is one integral, computed twice with 30 digits by Gauss and Legendre on intervals that crowd where the film
lingers: over r = xi**2, with the stretch from equilibrium at each node, and over w = 1/lambda, with xi from the load.
Ramps are the Taylor series of `loading.py`, in time, w, r and in time, lambda, xi. A film under a pre-stretch begins
relaxed; one under a stress begins fresh, xi = 1.

python tests/reference/dead_load.py            the table anew (needs heyoka and mpmath)
python tests/reference/dead_load.py --check 10 as many of its rows computed again and compared
"""

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from loading import SEED, Real, _real, linear, mp, passage, relaxed, unknown
from table import read_hashed, write_hashed

PATH = Path(__file__).resolve().parent / "dead_load.csv"
COLUMNS = (
    "program",
    "modulus_ratio",
    "prestretch",
    "stress",
    "field",
    "rate",
    "outcome",
    "time_to_failure",
    "critical_stretch",
    "critical_internal_stretch",
    "critical_field",
    "final_stretch",
    "agreement",
    "kind",
)
SURVIVES, FAILS_LATER, FAILS_AT_ONCE = range(3)
REQUIRED = 2e-13  # relative difference of the two formulations, at most
POINTS = 70
E_C = mp.mpf(3) / 4 * mp.mpf(4) ** (-mp.mpf(1) / 3)


def carried(r, p, sigma):
    """Return w at the instability and the load there."""
    A, B = 1 + p / r, 1 + p * r * r
    w = (A / B) ** (mp.mpf(1) / 6)
    while True:
        change = (8 * B * w**6 + 3 * sigma * w - 2 * A) / (48 * B * w**5 + 3 * sigma)
        w -= change
        if abs(change) < w * mp.mpf(10) ** -24:
            return w, A * w**2 - B * w**8 - sigma * w**3


def newton(function, x):
    """Return a root from a guess: function returns value and slope; by floats, then by 30 digits."""
    near = float(x)
    for _ in range(200):
        value, slope = function(near)
        change = float(value) / float(slope)
        near -= change
        if abs(change) < 1e-12 * abs(near):
            break
    x = mp.mpf(near)
    for _ in range(4):
        value, slope = function(x)
        x -= value / slope
    return x


def stable(r, p, sigma, e):
    """Return w in equilibrium on its stable side."""

    def miss(w):
        A, B, s, load = (1 + p / r, 1 + p * r * r, sigma, e) if isinstance(w, mp.mpf) else floats
        return A * w**2 - B * w**8 - s * w**3 - load, -w * (8 * B * w**6 + 3 * s * w - 2 * A)

    floats = float(1 + p / r), float(1 + p * r * r), float(sigma), float(e)
    return newton(miss, (floats[0] / floats[1]) ** (1 / 6))


def zero(function, low, high):
    """Return the zero of a decreasing function in an interval."""
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) > 0 else (low, middle)
    return (low + high) / 2


def step_over_r(r0, r1, p, sigma, e):
    """Time to failure as the integral of dr over dr/dT; r1 - r = (r1 - r0) t**2, regular at the instability."""

    def integrand(t):
        r = r1 - (r1 - r0) * t * t
        w = stable(r, p, sigma, e)
        z = r * w * w
        return (r1 - r0) * t / (1 / z - z * z)

    return integral(integrand, pieces(lambda t: integrand(t) / t, mp.mpf(0), mp.mpf(1)))


def step_over_w(w0, w1, p, sigma, e):
    """Time to failure as the integral of D z**2/(2 w (1 + 2 z**3) N) over w, N = p u**2 h."""

    def integrand(w):
        u = w * w
        N = e - u + u**4 + sigma * w**3
        h = N / (p * u * u)
        z = newton(lambda z: (z**3 + h * z - 1, 3 * z * z + h), 1 / (1 + h))
        D = 8 * u**3 + 3 * sigma * w - 2 + 2 * p * u * (3 * z * z - h)
        return D * z * z / (2 * w * (1 + 2 * z**3) * N)

    return integral(integrand, pieces(integrand, w1, w0))


def integral(function, cuts):
    """Return an integral by 48 nodes in each interval."""
    return mp.quad(function, cuts, method="gauss-legendre", maxdegree=5)


def pieces(function, low, high):
    """Return an interval cut about the place where a function is largest, ever closer to it."""
    a, b = low, high
    while b - a > (high - low) * mp.mpf(10) ** -6:
        grid = [a + (b - a) * k / 10 for k in range(1, 10)]
        values = [function(x) for x in grid]
        k = values.index(max(values))
        a, b = grid[k - 1] if k > 0 else a, grid[k + 1] if k < 8 else b
    peak = (a + b) / 2
    cuts = {low, high, peak}
    for j in range(1, 8):
        width = (high - low) * mp.mpf(10) ** -j
        cuts |= {x for x in (peak - width, peak + width) if low < x < high}
    return sorted(cuts)


def solve_step(m, start, sigma, field):
    """Return outcome, results by both formulations."""
    p, s = mp.mpf(m) - 1, mp.mpf(sigma)
    r0, e = mp.mpf(start) ** 2, E_C * mp.mpf(field) ** 2
    w_i, largest = carried(r0, p, s)
    if e >= largest:
        found = (mp.mpf(0), 1 / w_i, mp.sqrt(r0), mp.sqrt(largest / E_C))
        return FAILS_AT_ONCE, found, found
    if e <= carried(mp.mpf(1), mp.mpf(0), s)[1]:
        return SURVIVES, None, None
    high = 2 * r0
    while carried(high, p, s)[1] > e:
        high *= 2
    r1 = zero(lambda r: carried(r, p, s)[1] - e, r0, high)
    w1, _ = carried(r1, p, s)
    w0 = stable(r0, p, s, e)
    rest = (1 / w1, mp.sqrt(r1), mp.mpf(field))
    return FAILS_LATER, (step_over_r(r0, r1, p, s, e), *rest), (step_over_w(w0, w1, p, s, e), *rest)


def solve_ramp(m, start, sigma, field, rate):
    """Return outcome, results by both formulations; ``field`` None for a ramp without end."""
    p, s, r0 = Real(m) - 1, Real(sigma), Real(start) ** 2
    if field is not None and relaxed(field, s)[0] is not None:
        return SURVIVES, None, None
    if field is None:
        way = [(0.0, rate, 0.0, 1.0, 1e9)]
    else:
        way = [(0.0, rate, 0.0, 1.0, field / rate), linear(field, field, 1e9)]
    found = []
    for formulation in "AB":
        failed, time, r, at = passage(formulation, way, r0, p, s)
        if not failed:
            raise ArithmeticError("no failure")
        found.append((time, 1 / unknown(r, p, s, Real(0))[1], np.sqrt(r), at))
    return FAILS_LATER, *found


def certify(program, m, prestretch, stress, field, rate):
    """Return the row of a point, or None where the formulations differ."""
    start = prestretch or 1.0
    sigma = prestretch - prestretch**-5 if prestretch else stress
    if program == "step":
        outcome, a, b = solve_step(m, start, sigma, field)
    else:
        outcome, a, b = solve_ramp(m, start, sigma, field, rate)
    row = {"program": program, "modulus_ratio": repr(m), "outcome": str(outcome)}
    given = {"prestretch": prestretch, "stress": stress, "field": field, "rate": rate}
    row |= {name: repr(value) for name, value in given.items() if value is not None}
    if outcome == SURVIVES:
        row["final_stretch"] = _text(relaxed(field, Real(sigma))[0])
        return row | {"agreement": "0"}
    difference = max(abs(float(x / y - 1)) for x, y in zip(a, b, strict=True) if y != 0) if a is not b else 0.0
    if difference > REQUIRED:
        return None
    names = ("time_to_failure", "critical_stretch", "critical_internal_stretch", "critical_field")
    row |= {name: _text(value) for name, value in zip(names, a, strict=True)}
    return row | {"agreement": f"{difference:.1e}"}


def _text(x) -> str:
    return np.format_float_scientific(x if isinstance(x, Real) else _real(x), 17, unique=False, trim="-")


def points(program: str) -> Iterator[tuple[str, tuple]]:
    """Yield kind and arguments: beside the thresholds and between them."""
    random = np.random.default_rng([SEED + 1, *program.encode()])
    while True:
        m = float(np.exp(random.uniform(math.log(1.05), math.log(1000.0))))
        prestretched = random.random() < 0.5
        prestretch = float(random.uniform(1.05, 6.0)) if prestretched else None
        stress = None if prestretched else float(random.uniform(0.1, 6.0))
        sigma = prestretch - prestretch**-5 if prestretch else stress
        at_rest = float(mp.sqrt(carried(mp.mpf(1), mp.mpf(0), mp.mpf(sigma))[1] / E_C))
        r0 = mp.mpf(prestretch or 1) ** 2
        at_once = float(mp.sqrt(carried(r0, mp.mpf(m) - 1, mp.mpf(sigma))[1] / E_C))
        rate = None if program == "step" else float(10 ** random.uniform(-3, 4)) * at_rest
        if program == "ramp":
            yield "apart", (m, prestretch, stress, None, rate)
            continue
        for gap in (-1e-3, -1e-9, 1e-9, 1e-6, 1e-3):
            yield "beside_relaxed", (m, prestretch, stress, at_rest * (1 + gap), rate)
        for share in (0.05, 0.3, 0.8):
            yield "apart", (m, prestretch, stress, at_rest + share * (at_once - at_rest), rate)
        if program == "step":
            for gap in (-1e-3, -1e-6, -1e-9, 1e-9):
                yield "beside_instant", (m, prestretch, stress, at_once * (1 + gap), rate)


def generate() -> None:
    """Compute the table and write it."""
    rows = []
    for program in ("step", "ramp", "ramp_hold"):
        mine = []
        for kind, point in points(program):
            row = certify(program, *point)
            if row is not None:
                mine.append(row | {"kind": kind})
            if len(mine) == POINTS:
                break
        print(program, len(mine), file=sys.stderr, flush=True)
        rows += mine
    lines = [",".join(COLUMNS)] + [",".join(row.get(name, "") for name in COLUMNS) for row in rows]
    notes = [
        f"dea_maps reference: {len(rows)} films under a dead load, certified by two formulations",
        "made by: python tests/reference/dead_load.py",
        f"agreement: relative difference of the formulations, at most {REQUIRED}",
    ]
    write_hashed(PATH, notes, "\n".join(lines) + "\n")


def read() -> list[dict[str, str]]:
    """Return the rows of the table as text; ValueError if they do not match the hash."""
    return read_hashed(PATH)


def confirmed(stored: dict[str, str]) -> bool:
    """Compute a row again; whether it is what is stored."""
    names = ("modulus_ratio", "prestretch", "stress", "field", "rate")
    row = certify(stored["program"], *(float(stored[name]) if stored[name] else None for name in names))
    return row is not None and all(stored[name] == value for name, value in row.items() if name != "agreement")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--check"]:
        chosen = np.random.default_rng().choice(np.array(read()), int(sys.argv[2]), replace=False)
        failed = [row for row in chosen if not confirmed(row)]
        sys.exit(f"not confirmed: {failed}" if failed else 0)
    generate()
