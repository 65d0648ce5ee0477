"""Opening a map: what is whole is opened, what is damaged or foreign is refused in one line, nothing crashes."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm

CUBE = {"field": np.linspace(0.8, 2.2, 9), "rate": np.geomspace(1e-3, 1e3, 8)}
MUTATE = """
import sys
import warnings
import numpy as np
import xarray as xr
import dea_maps as dm
warnings.simplefilter("ignore")
whole, seed = sys.argv[1], int(sys.argv[2])
changed = whole + ".changed"
data, good = open(whole, "rb").read(), xr.load_dataset(whole)
rng = np.random.default_rng(seed)
for number in range(250):
    mutant, place = bytearray(data), rng.integers(len(data))
    if number % 4 < 2:
        mutant[place] ^= 1 << rng.integers(8)
    elif number % 4 == 2:
        del mutant[place:]
    else:
        mutant[place : place + 100] = rng.bytes(len(mutant[place : place + 100]))
    with open(changed, "wb") as stream:
        stream.write(mutant)
    try:
        with dm.open(changed) as ds:
            print("same" if ds.load().identical(good) else "another map")
    except ValueError as error:
        print("refused" if str(error).startswith(changed) and "\\n" not in str(error) else repr(error))
"""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "map.nc"


@pytest.mark.parametrize("ratio", [4.0, [2.0, 4.0]])
@pytest.mark.parametrize("stored", [{}, {"variables": ["time_to_failure"]}, {"dtype": "float32"}])
def test_what_was_written_is_opened(path, ratio, stored):
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, modulus_ratio=ratio, **stored)
    with dm.open(path) as ds:
        xr.testing.assert_identical(ds, xr.load_dataset(path))


ATTRIBUTES = {
    "long_name": "what we set",
    "standard_name": "our_field",
    "note": "of the \N{MICRO SIGN}m film",
    "numbers": [1.0, 2.5],
    "words": ["thick", "thin"],
    "valid_max": 1.0,
    "nothing": "",
    "count": np.int16(3),
    "unknown": np.nan,
}


@pytest.mark.parametrize("disk", [False, True])
def test_maps_with_the_users_attributes_are_opened(path, disk):
    """Attributes of parameters, and of coordinates that came with them, come back as they were given."""
    label = xr.Variable("field", ["a", "b", "c"], {"long_name": "label", "order": 3})
    field = xr.DataArray([0.9, 1.2, 3.0], dims="field", coords={"label": label}, attrs=ATTRIBUTES)
    given = {"field": field, "modulus_ratio": xr.DataArray(4.0, attrs={"long_name": "stiffening"})}
    whole = dm.sweep(dm.Step(), **given)
    dm.sweep_to_netcdf(path, dm.Step(), **given) if disk else whole.to_netcdf(path)
    with dm.open(path) as ds:
        xr.testing.assert_identical(ds.load(), whole)
        for name, value in ATTRIBUTES.items():
            np.testing.assert_array_equal(ds.field.attrs[name], value)
        assert ds.modulus_ratio.attrs["long_name"] == "stiffening"


REFUSED = {
    "scale_factor": 0.1,
    "add_offset": 1.0,
    "missing_value": 0.9,
    "_FillValue": 1.2,
    "dtype": "bool",
    "coordinates": "label",
    "nothing": None,
    "table": {"a": 1},
    "truth": True,
    "large": 2**70,
    "square": np.ones((2, 2)),
    "complex": 1j,
    "ends": "early\0",
    "a/b": 1,
    "NAME": "field",
    "CLASS": "DIMENSION_SCALE",
    "_NCProperties": "mine",
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("place", ["field", "label"])
def test_attributes_that_no_file_gives_back_are_refused(name, place, path, monkeypatch):
    attrs = {"note": "kept", name: REFUSED[name]}
    label = xr.Variable("field", [3.0, 4.0], attrs if place == "label" else {})
    field = xr.DataArray(
        [0.9, 1.2], dims="field", coords={"label": label}, attrs=attrs if place == "field" else {"note": "kept"}
    )
    monkeypatch.setattr("dea_maps.runs.maps.solve", None)
    for call in (dm.sweep, lambda *args, **given: dm.sweep_to_netcdf(path, *args, **given)):
        with pytest.raises(ValueError, match=f"^{place} has the attribute '{name}' = .*: leave it out$") as caught:
            call(dm.Step(), field=field, modulus_ratio=4.0)
        assert "\n" not in str(caught.value)
    assert not path.exists()


def test_units_that_turn_numbers_into_dates_are_refused(path):
    day = xr.Variable("field", [3.0, 4.0], {"units": "days since 2000-01-01"})
    field = xr.DataArray([0.9, 1.2], dims="field", coords={"day": day})
    with pytest.raises(ValueError, match="day has the attribute 'units' = 'days since 2000-01-01'"):
        dm.sweep(dm.Step(), field=field, modulus_ratio=4.0)
    dates = day.copy(data=np.array(["2000-01-04", "2000-01-05"], "datetime64[ns]"))
    dates.attrs = {}
    given = {"field": field.assign_coords(day=dates), "modulus_ratio": 4.0}
    dm.sweep_to_netcdf(path, dm.Step(), **given)
    with dm.open(path) as ds:
        xr.testing.assert_identical(ds.load(), dm.sweep(dm.Step(), **given))


@pytest.mark.parametrize("bad", ["a/b", "of film"])
def test_names_that_no_file_gives_back_are_refused(bad):
    field = xr.DataArray([0.9, 1.2], dims="film", coords={bad: ("film", [1, 2])})
    with pytest.raises(ValueError, match=f"^{bad} has a name"):
        dm.sweep(dm.Step(), field=field, modulus_ratio=4.0)


@pytest.mark.parametrize(("ratio", "seed"), [(4.0, 1), ([2.0, 4.0], 2)])
def test_mutants_neither_crash_nor_pass_for_another_map(path, ratio, seed):
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, modulus_ratio=ratio)
    done = subprocess.run([sys.executable, "-c", MUTATE, path, str(seed)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    verdicts = done.stdout.splitlines()
    assert len(verdicts) == 250
    assert set(verdicts) == {"same", "refused"}
    assert verdicts.count("refused") > 50  # the others changed what is not used


def without(name):
    return lambda ds: ds.drop_vars(name)


def with_values(name, change):
    return lambda ds: ds.assign({name: ds[name].copy(data=change(ds[name].values))})


WRONG = {
    "no rate": without("rate"),
    "no maps": lambda ds: ds.drop_vars(ds.data_vars),
    "another program": lambda ds: ds.assign_attrs(program="sine"),
    "another method": lambda ds: ds.assign_attrs(method="euler"),
    "no accuracy": lambda ds: ds.drop_attrs(deep=False).assign_attrs(
        {k: v for k, v in ds.attrs.items() if k != "rtol"}
    ),
    "another type": lambda ds: ds.assign(outcome=ds.outcome.astype(np.int16)),
    "another unit": lambda ds: ds.assign(critical_stretch=ds.critical_stretch.assign_attrs(units="m")),
    "transposed": lambda ds: ds.assign(critical_stretch=ds.critical_stretch.transpose()),
    "other flags": lambda ds: ds.assign(outcome=ds.outcome.assign_attrs(flag_meanings="a b c d")),
    "no flag": with_values("outcome", lambda values: values + np.int8(4)),
    "another outcome": with_values("outcome", np.zeros_like),
    "impossible": with_values("critical_stretch", lambda values: values - 1),
    "before it began": with_values("time_to_failure", np.negative),
    "out of bounds": lambda ds: ds.assign_coords(modulus_ratio=ds.modulus_ratio - 4),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_map_is_refused(name, path):
    WRONG[name](dm.sweep(dm.RampHold(), **CUBE, modulus_ratio=4.0)).to_netcdf(path)
    with pytest.raises(ValueError, match=f"{path} is not a map") as caught:
        dm.open(path)
    assert "\n" not in str(caught.value)


def test_what_is_not_there_is_named(path):
    with pytest.raises(FileNotFoundError, match=f"there is no file {path}"):
        dm.open(path)
    path.write_text("a note")
    with pytest.raises(ValueError, match=f"{path} is not a map"):
        dm.open(path)


def test_a_repeated_program_with_every_outcome_is_opened(tmp_path):
    ds = dm.sweep(dm.PulseTrain(), field=[0.9, 1.5, 2.5], period=1.0, duty=0.5, modulus_ratio=4.0)
    assert ds.outcome.values.tolist() == [0, 1, 2]
    ds.to_netcdf(tmp_path / "map.nc")
    with dm.open(tmp_path / "map.nc") as opened:
        xr.testing.assert_identical(opened.load(), ds)


def test_a_map_with_an_earlier_name_of_a_formulation_is_opened(path):
    ds = dm.sweep(dm.Ramp(), rate=[0.1, 1.0], modulus_ratio=[2.0, 4.0], prestretch=2.0)
    ds.attrs["formulation"] = "length"
    ds.to_netcdf(path)
    with dm.open(path) as opened:
        xr.testing.assert_identical(opened.load(), ds)
        dm.charts.failure_curves(opened)
