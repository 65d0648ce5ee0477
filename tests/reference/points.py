"""The points of the tables: every regime, both sides of every class boundary, and a random spread.

All inputs are doubles; what is computed belongs to their exact values.
"""

import math
from collections.abc import Iterator
from fractions import Fraction
from itertools import product

import numpy as np
import ramps
from model import Inputs, real

SEED = 20110607

MODULUS_RATIOS = (
    1.0,
    math.nextafter(1.0, 2.0),
    1.0 + 1e-15,
    1.0 + 1e-12,
    1.0 + 1e-8,
    1.0 + 1e-4,
    1.01,
    1.1,
    1.5,
    2.0,
    3.85,
    4.0,
    10.0,
    30.0,
    100.0,
    300.0,
    1000.0,
)
HOLD_RATIOS = (1.0, math.nextafter(1.0, 2.0), 1.0 + 1e-8, 1.01, 1.5, 4.0, 10.0, 100.0, 1000.0)
HOLD_RATES = (1e-6, 1e-3, 0.1, 1.0, 30.0, 1e5)
GAPS = (1e-3, 1e-6, 1e-9)
#: Ramps held beside the field at which they fail: modulus ratios and rates, some of them the worst of random ones for
#: a method that starts too boldly, follows the end of a slow ramp too boldly, or takes one event for the other.
CORNERS = (
    *product((1.01, 1.5, 4.0, 30.0, 1000.0), (1e-5, 1e-2, 1.0, 30.0, 1e4)),
    (1.4804396758828298, 3.7783428139487434),
    (1.6776, 6.3862),
    (6.649289374680985, 26.037324773669248),
    (65.3655423846561, 81.25511314125154),
    (57.21705239780105, 57.89224545858853),
    (1.2157939286049453, 6.8178906594862e-05),
    (1.3892006386586462, 1.852275406997094e-05),
    (1.3021394180642285, 3.98420826226799e-06),
    (1.0000714895218656, 66603.80886166825),
    (1.0004805078680732, 49709.88829338653),
    (1.0000013604908453, 2991.00441640663),
)
#: Distances of the held field from the one of failure, relative; one of each for a ramp.
ABOVE = (1e-12, 1e-8, 1e-4, 1e-1)
BELOW = (1e-1, 1e-3, 1e-4, 1e-6, 1e-7, 1e-9, 1e-10, 2e-11, 4e-12)


def points(program: str) -> list[dict[str, float]]:
    """Return the points of a program, without repetition, as keyword arguments of doubles."""
    makers = {"step": step_points, "ramp": ramp_points, "ramp_hold": ramp_hold_points}
    seen = {tuple(sorted(point.items())): point for point in makers[program]()}
    return list(seen.values())


def exact(program: str, point: dict[str, float]) -> Inputs:
    """Return a point with the exact values of its doubles."""
    return Inputs(program, **{name: Fraction(value) for name, value in point.items()})


def critical_neighbours() -> tuple[float, ...]:
    """Return fields at and beside the critical field."""
    below = (1 - 1e-3, 1 - 1e-6, 1 - 1e-9, 1 - 1e-12, math.nextafter(1.0, 0.0))
    above = (math.nextafter(1.0, 2.0), 1 + 1e-14, 1 + 1e-12, 1 + 1e-9, 1 + 1e-6, 1 + 1e-4, 1.01)
    return (*below, 1.0, *above)


def step_points() -> Iterator[dict[str, float]]:
    """Yield modulus ratio and field."""
    for m in MODULUS_RATIOS:
        root = math.sqrt(m)
        fields = [0.0, 1e-300, 0.3, 0.9, *critical_neighbours()]
        fields += [1 + (root - 1) * part for part in (0.1, 0.3, 0.6, 0.9)]
        fields += [root * (1 - gap) for gap in (*GAPS, 1e-12)]
        fields += [math.nextafter(root, 0.0), root, math.nextafter(root, math.inf), 1.1 * root, 1.5 * root]
        for field in fields:
            yield {"modulus_ratio": m, "field": field}
    random = np.random.default_rng(SEED)
    for m in np.exp(random.uniform(0, math.log(1000), 80)):
        yield {"modulus_ratio": float(m), "field": float(random.uniform(0.9, 1.1 * math.sqrt(m)))}


def ramp_points() -> Iterator[dict[str, float]]:
    """Yield modulus ratio and rate."""
    for m, power in product(MODULUS_RATIOS, range(-6, 6)):
        yield {"modulus_ratio": m, "rate": float(f"1e{power}")}
    random = np.random.default_rng(SEED + 1)
    for m in np.exp(random.uniform(0, math.log(1000), 130)):
        yield {"modulus_ratio": float(m), "rate": float(10 ** random.uniform(-6, 5))}


def ramp_hold_points() -> Iterator[dict[str, float]]:
    """Yield modulus ratio, field and rate; fields beside the one at which the pure ramp fails included."""
    for number, (m, rate) in enumerate(product(HOLD_RATIOS, HOLD_RATES)):
        limit = failing_field(m, rate)
        neighbours = critical_neighbours()
        # at each pair another choice of fields below, above, beside the ramp's limit, and beyond
        fields = [neighbours[number % 5], 1.0, neighbours[6 + number % 7], neighbours[6 + (number + 3) % 7]]
        fields += [limit * (1 - GAPS[(number + shift) % 3]) for shift in (0, 1)]
        fields += [limit * (1 + GAPS[number % 3]), (1 + limit) / 2]
        fields += [(0.5, 1.2, 1.0)[number % 3] * math.sqrt(m)]
        for field in fields:
            yield {"modulus_ratio": m, "field": field, "rate": rate}
    random = np.random.default_rng(SEED + 2)
    for m in np.exp(random.uniform(0, math.log(1000), 80)):
        field = float(random.uniform(0.9, 1.05 * math.sqrt(m)))
        yield {"modulus_ratio": float(m), "field": field, "rate": float(10 ** random.uniform(-6, 5))}
    yield from corner_points()


def corner_points() -> Iterator[dict[str, float]]:
    """Yield modulus ratio, field and rate with the field beside that of failure, where the film fails at either."""
    for number, (m, rate) in enumerate(CORNERS):
        limit = failing_field(m, rate)
        above = limit * (1 + ABOVE[number % len(ABOVE)])
        below = max(limit * (1 - BELOW[number % len(BELOW)]), (1 + limit) / 2)
        for field in (above, below):
            yield {"modulus_ratio": m, "field": field, "rate": rate}


def failing_field(m: float, rate: float) -> float:
    """Return the field at which a pure ramp fails, rounded to a double."""
    return float(ramps.ramp_failure(Fraction(rate), real(Fraction(m) - 1)).field)


def regime(inputs: Inputs, before_hold: bool) -> str:
    """Return the labels of a point: load, then film, joined by a slash."""
    return f"{load_regime(inputs, before_hold)}/{film_regime(inputs.modulus_ratio)}"


def film_regime(m: Fraction) -> str:
    """Return the label of a modulus ratio."""
    if m == 1:
        return "elastic"
    if m < Fraction("1.005"):
        return "nearly_elastic"
    return "moderate" if m <= 50 else "large"


def rate_regime(rate: Fraction, m: Fraction) -> str:
    """Return the label of a ramp by its rate against the film's relaxation, m/6 times tau."""
    effective = rate * m / 6
    for bound, label in ((Fraction("1e-4"), "very_slow"), (Fraction("1e-2"), "slow"), (10, "comparable")):
        if effective < bound:
            return label
    return "fast"


def load_regime(inputs: Inputs, before_hold: bool) -> str:
    """Return the label of a load by its distance from the class boundaries."""
    m, field, rate = inputs.modulus_ratio, inputs.field, inputs.rate
    if field is None:
        return rate_regime(rate, m)
    held = "" if rate is None else f"{rate_regime(rate, m)}_ramp_"
    if before_hold:
        return held + "fails_rising"
    if field < 1:
        return held + ("just_below_critical" if field >= Fraction("0.999") else "below")
    if field == 1:
        return held + "critical"
    if inputs.program == "step":
        gap = 1 - field**2 / m
        if gap <= 0:
            return "instant_limit" if gap > Fraction("-1e-9") else "at_once"
        if gap < Fraction("1e-2") and gap < field**2 - 1:
            return "almost_at_once"
    return held + ("bottleneck" if field < Fraction("1.011") else "middle")
