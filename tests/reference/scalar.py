"""Films under a field that follows straight lines between points, by one scalar equation in time.

Independent of the package: ``dr/dT = 2 (1/z - z**2)``, ``r = xi**2``, ``z = u r``, with ``u = lambda**-2`` solved for
anew in every evaluation from (23), ``e = A u - B u**4``, on the stable branch. The last part before a failure has
``D = 4 B u**3 - A`` as its variable, from where the time stops to exactly 0; that part counts only if it ends within
the line and ``D`` falls all along it. Survival is proved: under a field held without end a film survives exactly if
the load is less than it can carry, a relaxed state exists, and the dashpot has not passed the unstable relaxed state,
or goes back from beyond it.
"""

from math import inf, isnan, nan, sqrt
from typing import NamedTuple

from scipy.integrate import DOP853
from scipy.optimize import brentq

E_C = 0.75 * 4.0 ** (-1.0 / 3.0)
TOLERANCE = {"rtol": 2.5e-14, "atol": 1e-16}
MOST_STEPS = 3000  # of a line
FINISH = 0.5  # of A: from a smaller D on, the way to the instability is tried


class Film(NamedTuple):
    """What becomes of a film: NaN for one that survives."""

    time: float
    stretch: float
    field: float


SURVIVOR = Film(nan, nan, nan)


def coefficients(r, p):
    return 1.0 + p / r, 1.0 + p * r * r


def stable_u(e, r, p):
    """Return the larger root of (23), NaN where the load is more than the film carries."""
    a, b = coefficients(r, p)
    least = (a / (4.0 * b)) ** (1.0 / 3.0)
    if e > 0.75 * a * least:
        return nan
    u = (a / b) ** (1.0 / 3.0)  # where e = 0: right of the root, and Newton's method falls to it monotonically
    for _ in range(200):
        change = (e - a * u + b * u**4) / (4.0 * b * u**3 - a)
        u = max(u - change, least)
        if abs(change) < 2e-16 * u:
            break
    return u


def flow(u, r):
    z = u * r
    return 2.0 * (1.0 / z - z * z)


class Line(NamedTuple):
    """A field along a straight line from a time on."""

    start: float
    value: float
    slope: float
    p: float

    def field(self, time):
        return self.value + self.slope * (time - self.start)

    def load(self, time):
        return E_C * self.field(time) ** 2

    def in_time(self, time, y):
        r = float(y[0])
        return [flow(stable_u(self.load(time), r, self.p), r)] if r > 0.0 else [nan]

    def in_d(self, d, y):
        """Return the rates of time and r by D."""
        time, r = map(float, y)
        p = self.p
        a, b = coefficients(r, p)
        u = ((a + d) / (4.0 * b)) ** (1.0 / 3.0)
        rate = flow(u, r)
        load_rate = 2.0 * E_C * self.field(time) * self.slope
        n = load_rate + p * u * (1.0 / (r * r) + 2.0 * r * u**3) * rate
        speed = -12.0 * b * u * u * n + d * p * (8.0 * r * u**3 + 1.0 / (r * r)) * rate  # D dD/dT
        return [nan, nan] if speed >= 0.0 else [d / speed, d / speed * rate]


def finish(line, time, r, last):
    """Return the failure that a film goes to with D falling all along, before the end of the line, or None."""
    a, b = coefficients(r, line.p)
    u = stable_u(line.load(time), r, line.p)
    d = 4.0 * b * u**3 - a
    if not 0.0 < d < FINISH * a or isnan(line.in_d(d, [time, r])[0]):
        return None
    solver = DOP853(line.in_d, d, [time, r], 0.0, **TOLERANCE)
    while solver.status == "running":
        solver.step()
        if solver.status == "failed" or not solver.y[0] <= last:
            return None
    time, r = map(float, solver.y)
    a, b = coefficients(r, line.p)
    return Film(time, (4.0 * b / a) ** (1.0 / 6.0), line.field(time))


def survives(e, r, p):
    u = stable_u(e, r, p)
    if isnan(u) or e > E_C:
        return False
    top = 4.0 ** (-1.0 / 3.0)
    unstable = brentq(lambda u: u - u**4 - e, 0.0, top, xtol=1e-15) if e > 0.0 else 0.0
    return r * unstable < 1.0 or flow(u, r) <= 0.0


def follow(times, fields, modulus_ratio):
    """Return the failure of a film, or `SURVIVOR`; the field jumps where a time is given twice, and at 0.

    After the last time the field is held without end.
    """
    p = modulus_ratio - 1.0
    r = 1.0
    points = [(0.0, 0.0), *([] if times[0] == 0.0 else [(0.0, fields[0])]), *zip(times, fields, strict=True)]
    for (start, old), (stop, new) in zip(points, [*points[1:], (inf, fields[-1])], strict=True):
        if stop == start:
            a, b = coefficients(r, p)
            largest = sqrt(0.75 * a * (a / (4.0 * b)) ** (1.0 / 3.0) / E_C)
            if new >= largest > old:
                return Film(start, (4.0 * b / a) ** (1.0 / 6.0), largest)
            continue
        line = Line(start, old, (new - old) / (stop - start) if stop < inf else 0.0, p)
        if stop == inf and survives(line.load(start), r, p):
            return SURVIVOR
        failure, r = along(line, r, stop)
        if failure is not None:
            return failure
    raise AssertionError("the last line has no end")


def along(line, r, stop):
    """Return the failure on a line, or None and r at its end."""
    first = finish(line, line.start, r, stop)
    if first is not None:
        return first, r
    if not line.in_time(line.start, [r])[0] < inf:
        raise ArithmeticError(f"the line starts at the instability, at {line.start}")
    longest = inf if stop == inf else (stop - line.start) / 20.0
    solver = DOP853(line.in_time, line.start, [r], stop, max_step=longest, **TOLERANCE)
    for _ in range(MOST_STEPS):
        if solver.status != "running":
            return None, float(solver.y[0])
        time, r = solver.t, float(solver.y[0])
        solver.step()
        if solver.status == "failed":
            raise ArithmeticError(f"neither a failure nor an end of the line is found at {time}")
        failure = finish(line, solver.t, float(solver.y[0]), stop)
        if failure is not None:
            return failure, r
    raise ArithmeticError(f"too many steps at {solver.t}")
