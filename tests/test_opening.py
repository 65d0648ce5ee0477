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
