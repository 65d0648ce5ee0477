"""Electrical breakdown under programs that fall, oscillate and repeat, and under dead loads, against SciPy in time."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import dea_maps as dm

FACTOR = 0.75 * 4.0 ** (-1.0 / 3.0)
NONE, INSTABILITY, BREAKDOWN, UNRESOLVED = range(4)
RESULTS = ("time_to_breakdown", "breakdown_stretch", "breakdown_field")


def stretch_of(field, xi, ratio, load):
    """Solve (18) to (20) for the stretch on the branch that begins without field; NaN where there is none."""
    a, b = 1.0 + (ratio - 1.0) / xi**2, 1.0 + (ratio - 1.0) * xi**4

    def carried(w):
        return a * w**2 - b * w**8 - load * w**3

    top = brentq(lambda w: 8.0 * b * w**6 + 3.0 * load * w - 2.0 * a, 1e-3, 2.0, xtol=1e-15)
    e = FACTOR * field**2
    if carried(top) <= e:
        return math.nan
    return 1.0 / brentq(lambda w: carried(w) - e, top, (a / b) ** (1.0 / 6.0) + 1e-12, xtol=1e-15)


def first_passage(pieces, ratio, strength, *, xi=1.0, load=0.0, repeats=1):
    """Return time, stretch and field at breakdown: the flow (26) in time, with an event, piece by piece.

    ``pieces`` are pairs of a duration and the field as a function of the time in the piece; zero is a mere jump.
    """

    def over(field, xi):
        stretch = stretch_of(abs(field), xi, ratio, load)
        return abs(field) * stretch**2 / strength(stretch) - 1.0

    passed = 0.0
    for _ in range(repeats):
        for duration, field_at in pieces:
            if not over(field_at(0.0), xi) < 0.0:  # NaN: beyond the instability, and the strength before
                field = abs(field_at(0.0))
                while math.isnan(over(field, xi)):
                    field *= 0.999
                field = brentq(lambda field, xi=xi: over(field, xi), 0.0, field, xtol=1e-15)
                return passed, stretch_of(field, xi, ratio, load), field
            if duration == 0.0:
                continue

            def flow(time, state, field_at=field_at):
                stretch, xi = stretch_of(abs(field_at(time)), state[0], ratio, load), state[0]
                return [stretch**2 * xi**-3 - stretch**-4 * xi**3]

            def meets(time, state, field_at=field_at):
                return over(field_at(time), state[0])

            meets.terminal, meets.direction = True, 1.0
            run = solve_ivp(flow, (0.0, duration), [xi], "DOP853", rtol=1e-10, atol=1e-12, events=meets,
                            max_step=duration / 36.0)  # fmt: skip
            if run.t_events[0].size:
                (time,), ((xi,),) = run.t_events[0], run.y_events[0]
                field = abs(field_at(time))
                return passed + time, stretch_of(field, xi, ratio, load), field
            assert run.success
            passed, xi = passed + duration, run.y[0, -1]
    raise AssertionError("no breakdown")


def line(start, end, duration):
    return duration, lambda time: start + (end - start) * time / duration


def jump(field):
    return 0.0, lambda time: field


def hold(field, duration):
    return duration, lambda time: field


def sine(bias, amplitude, period):
    return period, lambda time: bias + amplitude * math.sin(2.0 * math.pi * time / period)


WAVEFORM = dm.Waveform([0.0, 0.5, 2.0, 2.5, 5.0], [0.2, 1.0, -0.4, -0.9, 1.1])
TWICE = dm.Sequence([dm.Hold(1.0), dm.Jump("peak"), dm.Jump(0.3), dm.Hold(1.0)])
CASES = {
    "trapezoid, while the field falls": (
        dm.Trapezoid(), {"field": 1.3, "rate": 5.0, "hold_time": 0.2, "fall_rate": 0.1, "modulus_ratio": 4.0},
        [line(0.0, 1.3, 0.26), hold(1.3, 0.2), line(1.3, 0.0, 13.0)], 1.92, {},
    ),
    "trapezoid, while it is held": (
        dm.Trapezoid(), {"field": 1.3, "rate": 5.0, "hold_time": 1.2, "fall_rate": 0.1, "modulus_ratio": 4.0},
        [line(0.0, 1.3, 0.26), hold(1.3, 1.2), line(1.3, 0.0, 13.0)], 1.85, {},
    ),
    "overdrive": (
        dm.Overdrive(), {"overdrive_field": 1.5, "overdrive_time": 0.3, "field": 0.9, "modulus_ratio": 4.0},
        [hold(1.5, 0.3), hold(0.9, 50.0)], 1.9, {},
    ),
    "overdrive, under the field held after it": (
        dm.Overdrive(), {"overdrive_field": 1.1, "overdrive_time": 0.3, "field": 0.97, "modulus_ratio": 4.0},
        [hold(1.1, 0.3), hold(0.97, 50.0)], 1.3, {},
    ),
    "pulse train": (
        dm.PulseTrain(), {"field": 1.35, "period": 0.8, "duty": 0.5, "modulus_ratio": 4.0},
        [hold(1.35, 0.4), hold(0.0, 0.4)], 2.05, {"repeats": 20},
    ),
    "triangle train": (
        dm.TriangleTrain(), {"field": 1.6, "period": 0.7, "modulus_ratio": 4.0},
        [line(0.0, 1.6, 0.35), line(1.6, 0.0, 0.35)], 2.3, {"repeats": 40},
    ),
    "biased sine": (
        dm.BiasedSine(), {"bias": 0.8, "amplitude": 0.3, "period": 1.7, "modulus_ratio": 4.0},
        [sine(0.8, 0.3, 1.7)], 1.34, {"repeats": 10},
    ),
    "sine that changes its sign": (
        dm.BiasedSine(), {"bias": 0.1, "amplitude": 1.2, "period": 3.0, "modulus_ratio": 10.0},
        [sine(0.1, 1.2, 3.0)], 1.5, {"repeats": 10},
    ),
    "waveform": (
        WAVEFORM, {"field": 1.1, "modulus_ratio": 3.0},
        [line(0.22, 1.1, 0.5), line(1.1, -0.44, 1.5), line(-0.44, -0.99, 0.5), line(-0.99, 1.21, 2.5)], 1.37, {},
    ),
    "a jump up and down again": (TWICE, {"peak": 1.4, "modulus_ratio": 4.0}, [hold(0.0, 1.0), jump(1.4)], 1.5, {}),
    "a jump to more than the film carries": (
        TWICE, {"peak": 2.4, "modulus_ratio": 4.0}, [hold(0.0, 1.0), jump(2.4)], 1.7, {},
    ),
    "pre-stretch": (
        dm.Step(), {"field": 0.27, "prestretch": 2.0, "modulus_ratio": 4.0}, [hold(0.27, 200.0)], 1.4,
        {"xi": 2.0, "load": 2.0 - 2.0**-5},
    ),
    "stress": (
        dm.RampHold(), {"field": 0.6, "rate": 0.2, "stress": 1.0, "modulus_ratio": 5.0},
        [line(0.0, 0.6, 3.0), hold(0.6, 50.0)], 1.3, {"load": 1.0},
    ),
    "pre-stretch and pulses": (
        dm.PulseTrain(), {"field": 0.5, "period": 1.0, "duty": 0.4, "prestretch": 1.5, "modulus_ratio": 4.0},
        [hold(0.5, 0.4), hold(0.0, 0.6)], 1.45, {"repeats": 30, "xi": 1.5, "load": 1.5 - 1.5**-5},
    ),
}  # fmt: skip


@pytest.mark.parametrize(("program", "parameters", "pieces", "constant", "more"), CASES.values(), ids=CASES)
def test_breaks_down_when_an_integration_in_time_does(program, parameters, pieces, constant, more):
    for strength in (lambda stretch: constant + 0.0 * stretch, lambda stretch: constant * 0.9 * stretch**0.3):
        ratio = parameters["modulus_ratio"]
        expected = first_passage(pieces, ratio, strength, **more)
        for rtol in (1e-4, 1e-8):
            ds = dm.breakdown(dm.sweep(program, **parameters), strength, rtol=rtol)
            assert ds.first_limit.item() == BREAKDOWN
            np.testing.assert_allclose([ds[name].item() for name in RESULTS], expected, rtol=max(rtol, 2e-8))


@pytest.mark.parametrize(
    ("parameters", "load"),
    [
        ({"field": 1.2, "period": 0.8, "duty": 0.5, "modulus_ratio": 4.0}, 0.0),
        ({"field": 1.1, "period": 6.0, "duty": 0.3, "modulus_ratio": 3.0}, 0.0),
        ({"field": 0.5, "period": 1.0, "duty": 0.4, "prestretch": 1.5, "modulus_ratio": 4.0}, 1.5),
    ],
)
def test_the_limit_cycle_decides_whether_pulses_ever_break_a_film_down(parameters, load):
    """The true field is largest at the end of a pulse, where the stretch of the limit cycle is."""
    ds = dm.sweep(dm.PulseTrain(), **parameters, rtol=1e-10)
    assert ds.outcome.item() == 0
    largest = parameters["field"] * ds.steady_stretch_max.item() ** 2
    assert dm.breakdown(ds, largest * (1.0 + 1e-6), rtol=1e-8).first_limit.item() == NONE
    found = dm.breakdown(ds, largest * (1.0 - 1e-6), rtol=1e-8)
    assert found.first_limit.item() == BREAKDOWN
    assert found.time_to_breakdown.item() > parameters["period"]
    pulse = found.time_to_breakdown.item() / parameters["period"] % 1.0
    assert pulse == pytest.approx(parameters["duty"], abs=1e-2)


def test_films_that_fail_after_many_cycles():
    ds = dm.sweep(dm.PulseTrain(), field=1.2853, period=1.0, duty=0.5, modulus_ratio=4.0, rtol=1e-9)
    true_field = (ds.critical_field * ds.critical_stretch**2).item()
    assert ds.cycles_to_failure.item() > 20.0
    above, below = (dm.breakdown(ds, true_field * (1.0 + off), rtol=1e-8) for off in (1e-6, -1e-6))
    assert above.first_limit.item() == INSTABILITY
    assert below.first_limit.item() == BREAKDOWN
    assert below.time_to_breakdown.item() <= ds.time_to_failure.item()
    assert below.time_to_breakdown.item() == pytest.approx(ds.time_to_failure.item(), rel=1e-4)


def test_a_map_of_trapezoids_is_answered_everywhere():
    ds = dm.sweep(dm.Trapezoid(), field=np.linspace(0.55, 2.5, 9), rate=[0.3, 3.0], hold_time=[0.0, 1.0],
                  fall_rate=[0.05, 1.0], modulus_ratio=[1.0, 4.0, 20.0], stress=[0.0, 1.0])  # fmt: skip
    ds = dm.breakdown(ds, lambda stretch: 1.5 * stretch**0.5)
    assert set(np.unique(ds.first_limit)) == {NONE, INSTABILITY, BREAKDOWN}
    broken = (ds.first_limit == BREAKDOWN).values
    over = ds.breakdown_field * ds.breakdown_stretch**1.5 / 1.5
    np.testing.assert_allclose(over.values[broken], 1.0, rtol=1e-6)
    fails = broken & (ds.outcome == 1).values
    assert (ds.time_to_breakdown <= ds.time_to_failure).values[fails].all()
