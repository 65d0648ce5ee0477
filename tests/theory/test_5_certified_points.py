"""Every adaptive method against the certified tables, in the region that it claims, and "auto" everywhere."""

import importlib.util
from functools import cache
from pathlib import Path

import numba
import numpy as np
import pytest
import xarray as xr

import dea_maps as dm

PROGRAMS = {"step": dm.Step(), "ramp": dm.Ramp(), "ramp_hold": dm.RampHold()}
UNRESOLVED = 3
#: Results that are promised, and the columns with their condition numbers.
PROMISED = {"time_to_failure": "time", "critical_stretch": "stretch", "critical_field": "field"}
#: Double precision's own limit, in units of the condition number.
LIMIT = 4e-15

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # without the compiler, idle lanes warn


@cache
def table(program):
    """Read a reference table, thinned out where nothing is compiled; its module is no part of a package."""
    path = Path(__file__).parents[1] / "reference" / "table.py"
    spec = importlib.util.spec_from_file_location("reference_table", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    stride = 9 if numba.config.DISABLE_JIT else 1
    return {name: column[::stride] for name, column in module.load(program).items()}


def everywhere(rows):
    return np.ones(rows["outcome"].size, bool)


def region_of_fold(rows):
    m = rows["modulus_ratio"]
    inside = m <= 10
    if "field" in rows:
        inside &= (rows["field"] - 1 >= 1e-2) & (rows["field"] < 0.99 * np.sqrt(m))
    if "rate" in rows:
        inside &= (rows["rate"] >= 1e-2) & (rows["rate"] <= 1e2)
    return inside


#: (method, formulation): region, and the values of rtol within it.
CLAIMS = {
    ("dop853", "area"): (everywhere, (1e-3, 1e-6, 1e-9, 1e-12)),
    ("dopri5", "area"): (everywhere, (1e-3, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)),
    ("radau5", "area"): (everywhere, (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)),
    ("quadrature", "stretch"): (everywhere, (1e-3, 1e-6, 1e-9, 1e-12)),
    ("dop853", "fold"): (region_of_fold, (1e-3, 1e-6, 1e-10)),
    ("dopri5", "fold"): (region_of_fold, (1e-3, 1e-6, 1e-10)),
}


def adaptive():
    """Every (method, formulation, program) that chooses its own steps and promises rtol."""
    return {
        (method.name, form, program)
        for method in dm.methods()
        if not method.kind.endswith("fixed step")
        for form, programs in method.serves.items()
        for program in programs
        if form not in {"rate", "time"}  # rtol is a local tolerance; held to its own table in kernels/test_loading.py
    }


CASES = [
    pytest.param(method, form, program, rtol, id=f"{method}-{form}-{program}-{rtol:g}")
    for method, form, program in sorted(adaptive())
    for rtol in CLAIMS.get((method, form), (None, ()))[1]
]


def test_every_adaptive_method_is_held_to_its_claim():
    assert {(method, form) for method, form, _ in adaptive()} == set(CLAIMS)


def solved(program, rows, **choice):
    parameters = {
        name: xr.DataArray(rows[name], dims="sample") for name in ("modulus_ratio", "field", "rate") if name in rows
    }
    return dm.sweep(PROGRAMS[program], **parameters, **choice)


def error_over_allowed(ds, rows, rtol):
    """Relative errors of all promised results over what is allowed: (results, samples); NaN where there is none."""
    ratios = []
    for name, condition in (*PROMISED.items(), ("final_stretch", "stretch")):
        # a result that does not depend on the inputs has no condition number
        allowed = rtol + LIMIT * (1 + np.nan_to_num(rows[f"condition_{condition}"]))
        expected = rows[name]
        atonce = expected == 0.0
        scale = np.where(atonce, 1.0, expected)
        ratios.append(np.abs(ds[name].values - expected) / scale / np.where(atonce, LIMIT, allowed))
    return np.array(ratios)


def worst(ratios, rows, where):
    """Describe the cell with the largest error, for the message of a failure."""
    ratios = np.where(where, np.nan_to_num(ratios, posinf=np.inf), 0.0)
    result, sample = np.unravel_index(np.argmax(ratios), ratios.shape)
    cell = {name: float(rows[name][sample]) for name in ("modulus_ratio", "field", "rate") if name in rows}
    return f"{[*PROMISED, 'final_stretch'][result]} {ratios[result, sample]:.2f} times what is allowed at {cell}"


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("program", PROGRAMS)
def test_auto(program, rtol):
    rows = table(program)
    ds = solved(program, rows, rtol=rtol, method="auto")
    assert np.array_equal(ds.outcome, rows["outcome"])
    ratios = error_over_allowed(ds, rows, rtol)
    for name in (*PROMISED, "critical_internal_stretch", "final_stretch"):
        assert np.array_equal(np.isnan(ds[name]), np.isnan(rows[name])), name
    assert not np.any(ratios > 1), worst(ratios, rows, True)


@pytest.mark.parametrize(("method", "form", "program", "rtol"), CASES)
def test_method(method, form, program, rtol):
    region, _ = CLAIMS[method, form]
    whole = table(program)
    inside = region(whole)
    rows = {name: column[inside] for name, column in whole.items()}
    if numba.config.DISABLE_JIT and not inside.any():
        pytest.skip("no row of the thinned table is in the region")
    assert rows["outcome"].size > (0 if numba.config.DISABLE_JIT else 2)
    ds = solved(program, rows, rtol=rtol, method=method, formulation=form)
    resolved = ds.outcome.values != UNRESOLVED
    assert np.array_equal(ds.outcome.values[resolved], rows["outcome"][resolved])
    assert np.count_nonzero(resolved) > 0.9 * resolved.size
    ratios = error_over_allowed(ds, rows, rtol)
    assert not np.any(ratios[:, resolved] > 1), worst(ratios, rows, resolved)
    assert np.all(np.isnan(ratios[:, ~resolved]))


def test_a_wrong_result_is_noticed():
    rows = table("step")
    ds = solved("step", rows, rtol=1e-12)
    harmed = ds.assign(time_to_failure=ds.time_to_failure * (1 + 3e-12))
    ratios = error_over_allowed(harmed, rows, 1e-12)
    assert np.count_nonzero(ratios[0] > 1) > 0.2 * np.count_nonzero(rows["outcome"] == 1)
