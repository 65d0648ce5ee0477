"""What becomes of a scene, by two formulations; the digits on which they agree; the conditioning.

Formulation A is a quadrature over u for constant loads and collocation over the field and the margin for
ramps; formulation B is Taylor series in rescaled time, from other equations and in other arithmetic.
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from math import isqrt

import constant_load
import ramps
import taylor
from model import FAILS_AT_ONCE, FAILS_LATER, SURVIVES, U_STAR, Inputs, State, mp, mpf, real, stretch_at_rest

#: Digits on which the formulations must agree, and digits stored.
REQUIRED_DIGITS = 24
STORED_DIGITS = 22
#: Relative change of an input for the conditioning; far below every distance from a class boundary.
NUDGE = Fraction(1, 10**20)
#: Half a unit in the last place, for the one kind of point that has no derivative.
HALF_ULP = Fraction(1, 2**53)


@dataclass(frozen=True)
class Results:
    """The numbers of a scene; None where the outcome has no such number."""

    time: mpf | None = None
    stretch: mpf | None = None
    internal_stretch: mpf | None = None
    field: mpf | None = None
    final_stretch: mpf | None = None


@dataclass(frozen=True)
class Certified:
    """Outcome, whether it fails before its hold, results, digits of agreement, conditioning per result."""

    outcome: int
    before_hold: bool
    results: Results
    digits: float
    conditions: dict[str, mpf]


def outcome_of(inputs: Inputs) -> int:
    """Return the outcome, decided in exact arithmetic by the rules of constant and of rising fields.

    A step fails at once if ``field**2 >= m``; a film of m > 1 whose field stays at or below 1 never fails. An
    elastic film (m = 1) fails when its field reaches 1.
    """
    m, field = inputs.modulus_ratio, inputs.field
    if field is None:
        return FAILS_LATER
    if inputs.program == "step" and field**2 >= m:
        return FAILS_AT_ONCE
    return SURVIVES if field < 1 or (field == 1 and m > 1) else FAILS_LATER


def failed_on_ramp(inputs: Inputs) -> State | None:
    """Return the failure of the pure ramp if the film does not get to hold its field, by formulation A."""
    state = ramps.ramp_failure(inputs.rate, real(inputs.modulus_ratio - 1))
    return state if inputs.field is None or real(inputs.field) >= state.field else None


def failure_a(inputs: Inputs) -> State:
    """Return the failure by quadrature and collocation."""
    m, field = inputs.modulus_ratio, inputs.field
    p = real(m - 1)
    if inputs.program == "step":
        u, start = constant_load.start_of_step(field, m), mpf(0)
    else:
        state = failed_on_ramp(inputs)
        if state is not None:
            return state
        u, start = ramps.state_at(field, inputs.rate, p)[0], real(field / inputs.rate)
    u_end, r_end = constant_load.failure_state(field, p)
    return State(start + constant_load.time_between(u, u_end, field, p), u_end, r_end, real(field))


def failure_b(inputs: Inputs, **accuracy: int) -> State:
    """Return the failure by Taylor series; an elastic film's hold begins no earlier than its failure."""
    if inputs.program == "ramp_hold" and inputs.modulus_ratio == 1:
        inputs = replace(inputs, program="ramp", field=None)
    return taylor.failure(inputs, **accuracy)


def results_of(state: State) -> Results:
    """Return what the tables hold of a failure."""
    return Results(state.time, 1 / mp.sqrt(state.u), mp.sqrt(state.r), state.field)


def rest_b(field: Fraction) -> mpf:
    """Return the steady stretch by bisection of ``lambda**-2 - lambda**-8 = e``, at twice the precision."""
    if field == 1:
        return mp.cbrt(2)
    with mp.workdps(2 * mp.dps):
        load = 3 * mp.cbrt(2) / 8 * real(field) ** 2
        low, high = mpf(1), mp.cbrt(2)
        for _ in range(2 * mp.prec // 3):
            middle = (low + high) / 2
            low, high = (middle, high) if middle**-2 - middle**-8 < load else (low, middle)
        return low


def certify(inputs: Inputs) -> Certified:
    """Return the certified outcome of a scene."""
    outcome = outcome_of(inputs)
    before_hold = False
    if outcome == SURVIVES:
        a = Results(final_stretch=stretch_at_rest(inputs.field))
        b = Results(final_stretch=rest_b(inputs.field))
        conditions = {"stretch": rest_condition(inputs.field)}
    elif outcome == FAILS_AT_ONCE:
        m = inputs.modulus_ratio
        root = mpf(isqrt(m.numerator << 400)) / isqrt(m.denominator << 400)
        a = Results(mpf(0), 1 / mp.sqrt(U_STAR), mpf(1), mp.sqrt(real(m)))
        b = Results(mpf(0), mp.cbrt(2), mpf(1), root)
        conditions = {"time": mpf(0), "stretch": mpf(0), "internal_stretch": mpf(0), "field": mpf(1) / 2}
    else:
        a, b = results_of(failure_a(inputs)), results_of(failure_b(inputs))
        conditions = failure_conditions(inputs)
        before_hold = inputs.program == "ramp_hold" and failed_on_ramp(inputs) is not None
    digits = agreement(a, b)
    if digits < REQUIRED_DIGITS:
        raise ArithmeticError(f"the formulations agree on {digits:.1f} digits only: {inputs}")
    return Certified(outcome, before_hold, a, digits, conditions)


def agreement(a: Results, b: Results) -> float:
    """Return the number of digits on which all numbers agree, 50 at most."""
    gap = mpf(10) ** -50
    for name, x in vars(a).items():
        y = getattr(b, name)
        if x:
            gap = max(gap, abs(x - y) / abs(x))
        elif x != y:
            raise ArithmeticError(f"{name}: {x} against {y}")
    return -float(mp.log10(gap))


def rest_condition(field: Fraction) -> mpf:
    """Return the conditioning of the steady stretch; at field 1 it has no derivative: over half an ulp."""
    nudge = HALF_ULP if field == 1 else NUDGE
    changed = stretch_at_rest(field * (1 - nudge))
    return abs(1 - changed / stretch_at_rest(field)) / real(nudge)


def failure_conditions(inputs: Inputs) -> dict[str, mpf]:
    """Return the relative change of each result per relative change of an input, the largest over the inputs.

    By differences, formulation B. All inputs are moved up, where the film still fails, and not at once.
    """
    accuracy = {"order": 34, "digits": 30}
    base = vars(results_of(failure_b(inputs, **accuracy)))
    worst = dict.fromkeys(("time", "stretch", "internal_stretch", "field"), mpf(0))
    for name in ("modulus_ratio", "field", "rate"):
        value = getattr(inputs, name)
        if value is None:
            continue
        moved = replace(inputs, **{name: value * (1 + NUDGE)})
        if outcome_of(moved) != FAILS_LATER:
            continue
        changed = vars(results_of(failure_b(moved, **accuracy)))
        for key in worst:
            worst[key] = max(worst[key], abs(changed[key] / base[key] - 1) / real(NUDGE))
    return worst
