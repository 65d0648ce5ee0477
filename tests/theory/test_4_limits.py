"""The limits and the tables that every implementation must reproduce, method by method."""

import math

import numpy as np
import pytest

import dea_maps as dm

ROOT2 = 2.0 ** (1.0 / 3.0)
SURVIVES, FAILS_LATER, FAILS_AT_ONCE = 0, 1, 2

# Ten digits each, m = 4; by two independent methods.
STEP = {  # field: time, critical stretch
    1.01: (26.29974290, 1.836637644),
    1.05: (9.028237529, 1.794411933),
    1.1: (5.063810275, 1.745635208),
    1.2: (2.443625636, 1.659354969),
    1.5: (0.5463781327, 1.464347835),
    1.9: (0.04174466466, 1.292932009),
}
RAMP = {  # rate: time, critical stretch, critical field
    0.001: (1020.124077, 1.825660206, 1.020124077),
    0.01: (107.7277738, 1.767283822, 1.077277738),
    0.1: (12.44370088, 1.625152786, 1.244370088),
    1.0: (1.581172717, 1.423228766, 1.581172717),
    100.0: (0.01987195524, 1.263978016, 1.987195524),
}
# The stretch that a field just above 1 or an endlessly slow ramp leads to.
LATEST_STRETCH = {2.0: 1.5420, 3.85: 1.8299, 4.0: 1.8477, 10.0: 2.3153}

REGULAR = [
    (program, method.name, formulation)
    for method in dm.methods()
    for formulation, programs in method.serves.items()
    for program in programs
    if formulation != "rate" and not method.kind.endswith("fixed step")
]


@pytest.mark.parametrize(("method", "formulation"), [names[1:] for names in REGULAR if names[0] == "step"])
def test_table_of_the_step(method, formulation):
    ds = dm.sweep(dm.Step(), field=list(STEP), modulus_ratio=4.0, rtol=1e-11, method=method, formulation=formulation)
    assert (ds.outcome == FAILS_LATER).all()
    np.testing.assert_allclose(ds.time_to_failure, [row[0] for row in STEP.values()], rtol=5e-10)
    np.testing.assert_allclose(ds.critical_stretch, [row[1] for row in STEP.values()], rtol=5e-10)
    np.testing.assert_allclose(ds.critical_field, list(STEP), rtol=1e-15)


@pytest.mark.parametrize(("method", "formulation"), [names[1:] for names in REGULAR if names[0] == "ramp"])
def test_table_of_the_ramp(method, formulation):
    rtol = 1e-9 if method == "radau5" else 1e-10 if method == "dopri5" else 1e-11
    ds = dm.sweep(dm.Ramp(), rate=list(RAMP), modulus_ratio=4.0, rtol=rtol, method=method, formulation=formulation)
    assert (ds.outcome == FAILS_LATER).all()
    for name, column in (("time_to_failure", 0), ("critical_stretch", 1), ("critical_field", 2)):
        np.testing.assert_allclose(ds[name], [row[column] for row in RAMP.values()], rtol=1e-9)


@pytest.mark.parametrize(("method", "formulation"), [names[1:] for names in REGULAR if names[0] == "ramp_hold"])
def test_ramp_and_hold_is_the_ramp_or_tends_to_the_step(method, formulation):
    given = {"modulus_ratio": 4.0, "rtol": 1e-9, "method": method, "formulation": formulation}
    rising = dm.sweep(dm.RampHold(), field=1.7, rate=1.0, **given)
    np.testing.assert_allclose(rising.time_to_failure, RAMP[1.0][0], rtol=2e-9)
    np.testing.assert_allclose(rising.critical_field, RAMP[1.0][2], rtol=2e-9)
    # The time that the ramp itself takes, 1.2/rate, is what separates it from the step, to leading order.
    held = dm.sweep(dm.RampHold(), field=1.2, rate=[1e3, 1e4], **given)
    delays = (held.time_to_failure.values - STEP[1.2][0]) * held.rate.values
    assert np.all(delays > 0.5)
    assert np.all(delays < 1.2)
    np.testing.assert_allclose(held.critical_stretch, STEP[1.2][1], rtol=2e-9)


@pytest.mark.parametrize("program", [dm.Step(), dm.RampHold()], ids=lambda program: program.name)
@pytest.mark.parametrize("field", [0.0, 0.5, math.nextafter(1.0, 0.0), 1.0])
def test_survives_up_to_the_relaxed_critical_field(program, field):
    given = {"rate": 1.0} if "rate" in program.parameters else {}
    ds = dm.sweep(program, field=field, modulus_ratio=[1.0 + 1e-9, 4.0, 900.0], **given)
    assert (ds.outcome == SURVIVES).all()
    u = ds.final_stretch.values**-2.0
    np.testing.assert_allclose(u - u**4, 0.75 * 4.0 ** (-1.0 / 3.0) * field**2, atol=1e-15)
    assert np.all(ds.final_stretch <= ROOT2 * (1 + 1e-15))


@pytest.mark.parametrize("ratio", [1.0, 1.0 + 2**-52, 2.0, 3.0, 4.0, 10.0, 1000.0])
def test_fails_at_once_exactly_from_the_square_root_of_the_modulus_ratio(ratio):
    root = math.sqrt(ratio)
    fields = [math.nextafter(root, 0.0), root, math.nextafter(root, 9e9)]
    ds = dm.sweep(dm.Step(), field=fields, modulus_ratio=ratio)
    # Whole numbers decide: the square of a float against another float.
    at_once = [
        n * n * q >= p * d * d
        for n, d, p, q in ((*field.as_integer_ratio(), *ratio.as_integer_ratio()) for field in fields)
    ]
    np.testing.assert_array_equal(ds.outcome.values == FAILS_AT_ONCE, at_once)
    failed = ds.isel(field=2)
    assert failed.time_to_failure == 0.0
    np.testing.assert_allclose([failed.critical_stretch, failed.critical_field], [ROOT2, root], rtol=1e-15)


def test_an_elastic_film():
    step = dm.sweep(dm.Step(), field=[1.0, 1.5], modulus_ratio=1.0)
    assert (step.outcome == FAILS_AT_ONCE).all()
    ramp = dm.sweep(dm.Ramp(), rate=[1e-3, 1.0, 1e3], modulus_ratio=1.0, rtol=1e-11)
    np.testing.assert_allclose(ramp.time_to_failure, 1.0 / ramp.rate, rtol=1e-11)
    np.testing.assert_allclose(ramp.critical_stretch, ROOT2, rtol=1e-11)
    hold = dm.sweep(dm.RampHold(), field=[1.0, 1.5], rate=2.0, modulus_ratio=1.0, rtol=1e-11)
    assert (hold.outcome == FAILS_LATER).all()
    np.testing.assert_allclose(hold.time_to_failure, 0.5, rtol=1e-11)


@pytest.mark.parametrize("ratio", list(LATEST_STRETCH))
def test_the_bottleneck(ratio):
    gaps = np.array([1e-6, 1e-8, 1e-10, 1e-12])
    fields = 1.0 + gaps
    ds = dm.sweep(dm.Step(), field=fields, modulus_ratio=ratio, rtol=1e-10)
    leading = math.pi * (ratio - 1.0) / (3.0 * np.sqrt(fields - 1.0))
    wrong = np.abs(ds.time_to_failure / leading - 1.0)
    assert np.all(wrong < 3.0 * np.sqrt(gaps))  # the next term of the expansion
    np.testing.assert_allclose(ds.critical_stretch, LATEST_STRETCH[ratio], rtol=3e-5)


@pytest.mark.parametrize("ratio", list(LATEST_STRETCH))
def test_slow_and_fast_ramps(ratio):
    slow = dm.sweep(dm.Ramp(), rate=[1e-4, 1e-5, 1e-6], modulus_ratio=ratio, rtol=1e-9)
    beyond = slow.critical_field.values - 1.0
    assert np.all(beyond > 0.0)
    # Passing the fold of the slow manifold takes a field beyond 1 that falls like rate**(2/3), the more so the slower.
    wrong = np.abs(beyond[:-1] / beyond[1:] / 10.0 ** (2.0 / 3.0) - 1.0)
    assert wrong[1] < wrong[0] < 0.15
    late = np.abs(slow.critical_stretch.values / LATEST_STRETCH[ratio] - 1.0)
    assert np.all(np.diff(late) < 0.0)
    assert late[-1] < 3e-3
    fast = dm.sweep(dm.Ramp(), rate=[1e4, 1e5], modulus_ratio=ratio, rtol=1e-9)
    np.testing.assert_allclose(fast.critical_field, math.sqrt(ratio), rtol=1e-3)
    np.testing.assert_allclose(fast.critical_stretch, ROOT2, rtol=1e-3)
    assert np.all(fast.critical_field < math.sqrt(ratio))
