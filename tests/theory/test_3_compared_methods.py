"""The methods that others are compared with, under every kind of loading: order, agreement, what they do not answer."""

import numpy as np
import pytest

import dea_maps as dm

SURVIVES, FAILS_LATER, FAILS_AT_ONCE, UNRESOLVED = range(4)
TIME = {"method": "rk4", "formulation": "time"}
RATE = {"method": "rk4", "formulation": "rate"}

TRAPEZOID = (dm.Trapezoid(), {"field": 1.45, "rate": 2.0, "hold_time": 0.3, "fall_rate": 0.3, "modulus_ratio": 4.0})
OVERDRIVE = (dm.Overdrive(), {"field": 1.1, "overdrive_field": 1.6, "overdrive_time": 0.2, "modulus_ratio": 4.0})
BIASED_SINE = (dm.BiasedSine(), {"bias": 0.7, "amplitude": 0.8, "period": 1.5, "modulus_ratio": 3.0})
WAVEFORM = (dm.Waveform([0, 0.5, 1.2, 2.0], [0.2, 1.0, -1.1, 0.4]), {"field": 1.75, "modulus_ratio": 4.0})
LOADED = (dm.Trapezoid(), TRAPEZOID[1] | {"field": 1.1, "prestretch": 1.4})
FAILING = {
    "trapezoid": TRAPEZOID,
    "overdrive": OVERDRIVE,
    "biased_sine": BIASED_SINE,
    "waveform": WAVEFORM,
    "dead load": LOADED,
}
# Programs that are survived, a result that their smooth pieces decide, and a step that divides all of them.
SMOOTH = {
    "pulse": (dm.Pulse(), {"field": 1.3, "width": 0.8}, "largest_stretch", 0.2),
    "pulse, dead load": (dm.Pulse(), {"field": 0.9, "width": 1.6, "stress": 0.4}, "largest_stretch", 0.4),
    "pulse_train": (dm.PulseTrain(), {"field": 1.2, "period": 2.0, "duty": 0.4}, "steady_stretch_max", 0.2),
    "biased_sine": (dm.BiasedSine(), {"bias": 0.5, "amplitude": 0.3, "period": 1.6}, "steady_stretch_max", 0.2),
    "triangle_train": (dm.TriangleTrain(), {"field": 1.2, "period": 1.6}, "steady_stretch_min", 0.2),
}


@pytest.mark.parametrize("form", [TIME, RATE], ids=["time", "rate"])
@pytest.mark.parametrize("name", SMOOTH)
def test_fixed_steps_are_of_order_4_while_the_film_holds(name, form):
    program, given, result, step = SMOOTH[name]
    given = given | {"modulus_ratio": 4.0}
    truth = dm.sweep(program, **given, rtol=1e-10)[result].item()
    found = [dm.sweep(program, **given, **form, step=step / n)[result].item() for n in (2, 4, 8)]
    errors = np.abs(np.array(found) - truth)
    assert errors[-1] > 1e-10  # above the error of the truth
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 4.0, atol=0.45)


@pytest.mark.parametrize(("form", "least_order", "last"), [(TIME, 1.2, 1e-6), (RATE, 0.0, 1e-2)], ids=["time", "rate"])
@pytest.mark.parametrize("name", FAILING)
def test_both_forms_come_to_the_same_failure_as_the_step_falls(name, form, least_order, last):
    """The last step ends anywhere before the instability, and on the rate form now and then leaps over it: medians."""
    program, given = FAILING[name]
    truth = dm.sweep(program, **given, rtol=1e-10)
    assert truth.outcome == FAILS_LATER
    errors = np.empty((2, 15))
    for (row, column), _ in np.ndenumerate(errors):
        step = (1e-2, 1e-4)[row] * 1.3 ** (column / 14)
        ds = dm.sweep(program, **given, **form, step=step)
        errors[row, column] = abs(ds.time_to_failure / truth.time_to_failure - 1).item()
    long, short = np.median(np.nan_to_num(errors, nan=np.inf), axis=1)
    assert np.log(long / short) / np.log(100.0) > least_order
    assert short < last


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
@pytest.mark.parametrize("name", FAILING)
def test_adaptive_methods_on_the_rate_form_converge_with_their_tolerance(name, method):
    program, given = FAILING[name]
    truth = dm.sweep(program, **given, rtol=1e-10)
    errors = []
    for rtol in (1e-3, 1e-5, 1e-7):
        ds = dm.sweep(program, **given, method=method, formulation="rate", rtol=rtol)
        assert ds.outcome == FAILS_LATER
        errors.append(abs(ds.time_to_failure / truth.time_to_failure - 1).item())
    assert errors[-1] < 2e-5
    assert errors[-1] < 0.02 * errors[0]


def test_step_ramp_and_hold_on_the_form_in_time():
    """Where other kernels serve the same programs: at once, later, never."""
    for program, given in (
        (dm.Step(), {"field": [0.9, 1.3, 2.0, 2.5]}),
        (dm.Ramp(), {"rate": [0.1, 1.0]}),
        (dm.RampHold(), {"field": [0.9, 1.3], "rate": 1.0}),
    ):
        expected = dm.sweep(program, modulus_ratio=4.0, **given)
        found = dm.sweep(program, modulus_ratio=4.0, **given, **TIME, step=1e-3)
        assert np.array_equal(found.outcome, expected.outcome)
        for name in ("time_to_failure", "critical_stretch", "critical_field", "final_stretch"):
            np.testing.assert_allclose(found[name], expected[name], rtol=1e-5)


def test_a_train_fails_in_the_same_cycle():
    # Failures after some cycles, apart from thresholds in between.
    given = {"field": [1.32, 1.38, 1.5], "period": 1.0, "duty": 0.5, "modulus_ratio": 4.0}
    expected = dm.sweep(dm.PulseTrain(), **given)
    assert (expected.outcome == FAILS_LATER).all()
    assert (expected.cycles_to_failure > 0).any()
    for form in (TIME, {"method": "dop853", "formulation": "rate"}):
        accuracy = {"step": 1e-3} if form is TIME else {"rtol": 1e-9}
        found = dm.sweep(dm.PulseTrain(), **given, **form, **accuracy)
        assert np.array_equal(found.cycles_to_failure, expected.cycles_to_failure)
        np.testing.assert_allclose(found.time_to_failure, expected.time_to_failure, rtol=1e-4)


def test_cycles_are_counted_up_to_the_load_held_at_the_end():
    thrice = dm.Sequence([dm.Jump(1.5), dm.Hold(0.1)], repeat=3)
    for how in ({}, TIME | {"step": 0.01}, {"method": "dop853", "formulation": "rate"}):
        ds = dm.sweep(thrice, modulus_ratio=4.0, **how)
        assert ds.time_to_failure > 0.3
        assert ds.cycles_to_failure == 3


def test_steps_that_are_used_up_are_no_outcome():
    ds = dm.sweep(dm.Pulse(), field=[0.5, 1.9, 2.0], width=1.0, modulus_ratio=4.0, **RATE, step=1e-9)
    assert ds.outcome.values.tolist() == [UNRESOLVED, UNRESOLVED, FAILS_AT_ONCE]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"method": "dopri5", "formulation": "time"}, ("formulation", "'rate'", "'dopri5'", "'time'")),
        ({"method": "radau5"}, ("method", "'radau5'", "'rk4'", "'dop853'")),
        ({"method": "rk4", "formulation": "fold", "step": 0.1}, ("formulation", "'fold'", "'time'", "'rate'")),
    ],
)
def test_what_does_not_serve_a_program_is_refused_in_one_line(change, words):
    with pytest.raises(ValueError, match="must be one of") as refusal:
        dm.sweep(dm.Pulse(), field=1.2, width=1.0, modulus_ratio=4.0, **change)
    assert "\n" not in str(refusal.value)
    for word in words:
        assert word in str(refusal.value)
