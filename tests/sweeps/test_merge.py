"""Maps of parts of a grid, merged: the same as the map of the whole grid, or refused in one line."""

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm

FIELD, RATE, RATIO = np.linspace(0.8, 1.8, 6), np.geomspace(1e-2, 1e2, 5), np.array([2.0, 4.0, 6.0])
PARTS_ATTRIBUTES = ("history", "sharing")


def swept(field=FIELD, rate=RATE, modulus_ratio=RATIO, **how):
    return dm.sweep(dm.RampHold(), field=field, rate=rate, modulus_ratio=modulus_ratio, **how)


def without(ds):
    """Return a data set without what a merged map has of its own."""
    return ds.assign_attrs(dict.fromkeys(PARTS_ATTRIBUTES, ""))


@pytest.fixture(scope="module")
def whole():
    return swept()


@pytest.fixture(scope="module")
def step():
    return dm.sweep(dm.Step(), field=[0.9, 1.2], modulus_ratio=[2.0, 3.0])


@pytest.mark.parametrize(
    "cuts",
    [
        [{"modulus_ratio": slice(2, 3)}, {"modulus_ratio": slice(0, 2)}],
        [
            {"field": slice(0, 3), "rate": slice(0, 2)},
            {"field": slice(3, 6)},
            {"field": slice(0, 3), "rate": [2, 3, 4]},
        ],
        [{"rate": slice(0, 3)}, {"rate": slice(2, 5)}],
        [{"modulus_ratio": number} for number in range(3)],
        [{"field": slice(0, 5)}, {"field": 5}],
    ],
    ids=["along a parameter", "blocks", "a shared edge", "of one film each", "a row more"],
)
def test_parts_give_the_whole(whole, cuts):
    merged = dm.merge(whole.isel(cut) for cut in cuts).transpose(*whole.dims)
    assert without(merged).identical(without(whole))
    assert merged.outcome.dtype == np.int8


def test_maps_computed_apart_and_stored(whole, tmp_path):
    """Each part from its own sweep and file; the merged one is a map in every respect."""
    for number, fields in enumerate((FIELD[:2], FIELD[2:])):
        swept(fields).to_netcdf(tmp_path / f"{number}.nc")
    parts = [xr.open_dataset(tmp_path / f"{number}.nc") for number in range(2)]
    merged = dm.merge(parts)
    merged.to_netcdf(tmp_path / "merged.nc")
    for part in parts:
        part.close()
    with dm.open(tmp_path / "merged.nc") as opened:
        assert opened.identical(merged)
        assert without(opened).identical(without(whole))
    lines = merged.history.splitlines()
    assert [("2 values" in line, "4 values" in line) for line in lines] == [
        (True, False),
        (False, True),
        (False, False),
    ]
    assert lines[-1].endswith("2 maps merged")


def test_maps_in_volts_and_trajectories():
    film = {"material": dm.VHB, "thickness": 100e-6, "time_seconds": [0.0, 10.0, 100.0]}
    parts = [dm.trajectory(dm.Step(), voltage=volts, **film) for volts in (2000.0, 1500.0)]
    merged, whole = dm.merge(parts), dm.trajectory(dm.Step(), voltage=[1500.0, 2000.0], **film)
    assert merged.voltage.dims == ("field",)
    assert without(merged.transpose(*whole.dims)).identical(without(whole))


def test_scattered_points_with_numbers():
    def points(first):
        values = {"field": [1.1, 1.3], "modulus_ratio": [2.0 + first, 5.0]}
        given = {name: xr.DataArray(row, {"sample": [first, first + 1]}, "sample") for name, row in values.items()}
        return dm.sweep(dm.Step(), **given)

    merged = dm.merge([points(0), points(2)])
    assert merged.sample.values.tolist() == [0, 1, 2, 3]
    assert merged.modulus_ratio.values.tolist() == [2.0, 5.0, 4.0, 5.0]


def test_cells_that_are_left_out(step):
    other = dm.sweep(dm.Step(), field=[1.3], modulus_ratio=[3.0])
    with pytest.raises(
        ValueError, match=r"leave out 1 of 6 cells .* first at field = 1.3, modulus_ratio = 2.0: compute"
    ):
        dm.merge([step, other])


def test_cells_that_differ(step):
    other = step.copy(deep=True)
    other.critical_stretch[1, 1] += 1e-12
    with pytest.raises(
        ValueError, match=r"differ in critical_stretch at field = 1.2, modulus_ratio = 3.0, which map 1"
    ):
        dm.merge([step, other])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda ds: ds.assign_attrs(rtol=1e-3), "agree in the attribute rtol; got 1e-06 in map 0 and 0.001 in map 1"),
        (lambda ds: ds.assign_attrs(dea_maps_version="0"), "agree in the attribute dea_maps_version"),
        (lambda ds: ds.assign_attrs(thickness=1e-4), "agree in the attribute thickness; got None in map 0"),
        (lambda ds: ds.drop_vars("outcome"), "agree in the variables"),
        (lambda ds: ds.assign(outcome=ds.outcome.astype(float)), "agree in the type of outcome; got 'int8' in map 0"),
        (lambda ds: ds.assign(outcome=ds.outcome.drop_attrs()), "agree in the attribute flag_meanings of outcome"),
        (lambda ds: ds.drop_vars("field").rename(field="cell"), "agree in the variables"),
        (lambda ds: ds.reset_index("field").rename_dims(field="cell"), "map 1 has the dimension 'cell' without a"),
        (lambda ds: ds.drop_attrs(), "number 1 does not name its program"),
    ],
)
def test_maps_of_different_kinds(step, change, message):
    with pytest.raises(ValueError, match=message) as caught:
        dm.merge([step, change(step)])
    assert "\n" not in str(caught.value)


def test_what_are_no_maps(step):
    with pytest.raises(TypeError, match=r"maps must be data sets; got 'map.nc' as number 1"):
        dm.merge([step, "map.nc"])
    with pytest.raises(ValueError, match="at least one map; got none"):
        dm.merge([])
