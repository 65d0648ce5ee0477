"""The grid of a sweep: broadcasting, coordinates, and what is refused."""

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import dea_maps as dm
from dea_maps.pieces import Linear
from dea_maps.programs import Program
from dea_maps.sweeps.grid import make_grid

NAMES = ("field", "rate", "modulus_ratio")
SIZES = {"a": 2, "b": 3}


def along(*dims, start=1.0, **coords):
    """Return a DataArray with different values above 1 along dimensions of `SIZES`."""
    shape = [SIZES[dim] for dim in dims]
    return xr.DataArray(start + np.arange(np.prod(shape, dtype=int)).reshape(shape), dims=dims, coords=coords)


@st.composite
def parameters(draw):
    """Draw a number, an array or a DataArray for every parameter of a ramp and hold."""
    kinds = st.sampled_from(["number", "array", "a", "b", "ab", "ba"])
    given_, named = {}, {}
    for offset, name in enumerate(NAMES):
        start = 1.0 + 10 * offset
        kind = draw(kinds)
        if kind == "number":
            given_[name], named[name] = start, xr.DataArray(start)
        elif kind == "array":
            values = start + np.arange(draw(st.integers(0, 4)))
            given_[name], named[name] = values, xr.DataArray(values, dims=name)
        else:
            given_[name] = named[name] = along(*kind, start=start)
    return given_, named


@given(parameters())
def test_broadcasts_like_xarray(case):
    given_, named = case
    expected = xr.broadcast(*(named[name] for name in NAMES))
    grid = make_grid(dm.RampHold(), **given_)
    assert grid.dims == expected[0].dims
    assert grid.shape == expected[0].shape
    assert grid.cells == expected[0].size
    for name, array in zip(NAMES, expected, strict=True):
        np.testing.assert_array_equal(grid.parameters[name], array.values)
        xr.testing.assert_equal(xr.DataArray(grid.coords[name]), named[name])


def test_dimensions_come_in_order_of_appearance():
    grid = make_grid(dm.RampHold(), modulus_ratio=[2, 3], rate=along("b"), field=along("b", "a"))
    assert grid.dims == ("b", "a", "modulus_ratio")
    assert grid.shape == (3, 2, 2)


def test_a_billion_cells_take_no_room():
    values = np.linspace(1, 2, 1000)
    grid = make_grid(dm.RampHold(), field=values, rate=values, modulus_ratio=values)
    assert grid.cells == 10**9
    assert [grid.parameters[name].strides for name in NAMES] == [(8, 0, 0), (0, 8, 0), (0, 0, 8)]
    assert not any(array.flags.writeable for array in grid.parameters.values())


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.array(2), np.int8(2), xr.DataArray(2), xr.Variable((), 2)])
def test_any_real_number_is_a_scalar(value):
    grid = make_grid(dm.Step(), field=value, modulus_ratio=4)
    assert grid.shape == ()
    assert grid.parameters["field"] == 2.0
    assert grid.parameters["field"].dtype == np.float64
    assert grid.coords["field"].dims == ()


@pytest.mark.parametrize("value", [[1, 2], (1.0, 2.0), range(1, 3), np.array([1, 2], np.float32), np.uint8([1, 2])])
def test_any_row_of_real_numbers_is_a_dimension(value):
    grid = make_grid(dm.Step(), field=value, modulus_ratio=4)
    assert grid.dims == ("field",)
    assert grid.coords["field"].values.tolist() == [1.0, 2.0]
    assert grid.coords["field"].dtype == np.float64


@pytest.mark.parametrize("empty", [[], np.array([]), along("a")[:0]])
def test_no_values_make_no_cells(empty):
    grid = make_grid(dm.Step(), field=empty, modulus_ratio=[2, 3])
    assert grid.shape == (0, 2)
    assert grid.cells == 0


def test_values_are_copied():
    values = np.array([1.0, 2.0])
    grid = make_grid(dm.Step(), field=values, modulus_ratio=xr.DataArray(values, dims="modulus_ratio"))
    values[:] = 99.0
    assert grid.coords["field"].values.tolist() == [1.0, 2.0]
    assert grid.parameters["modulus_ratio"][0].tolist() == [1.0, 2.0]


def test_coordinates_come_along():
    when = np.array(["2026-01-01", "2026-01-02"], "datetime64[ns]")
    field = along("a", a=[10, 20], film=("a", ["x", "y"]), when=("a", when), batch=7)
    field.attrs = {"long_name": "field of the amplifier", "note": "kept"}
    field["batch"].attrs = {"units": "kg"}
    grid = make_grid(dm.Step(), field=field, modulus_ratio=along("a"))
    assert set(grid.coords) == {"field", "modulus_ratio", "a", "film", "when", "batch"}
    assert grid.coords["field"].attrs == {"long_name": "field of the amplifier", "note": "kept", "units": "1"}
    assert grid.coords["modulus_ratio"].attrs["units"] == "1"
    assert grid.coords["film"].values.tolist() == ["x", "y"]
    assert grid.coords["film"].attrs == {"long_name": "film", "units": "1"}
    assert grid.coords["batch"].attrs == {"long_name": "batch", "units": "kg"}
    assert "units" not in grid.coords["when"].attrs  # xarray writes them
    assert field["batch"].attrs == {"units": "kg"}


def test_conflicting_further_coordinates_fall_out_as_in_xarray():
    grid = make_grid(dm.Step(), field=along("a", film=1, batch=7), modulus_ratio=along("a", film=2, batch=7))
    assert set(grid.coords) == {"field", "modulus_ratio", "batch"}


def test_coordinates_of_an_earlier_result_can_be_used_again():
    earlier = xr.Dataset(coords={"field": ("a", [1.0, 2.0]), "modulus_ratio": ("a", [3.0, 4.0])})
    grid = make_grid(dm.Step(), field=earlier.field, modulus_ratio=earlier.modulus_ratio)
    assert grid.dims == ("a",)
    assert grid.coords["modulus_ratio"].values.tolist() == [3.0, 4.0]


def test_a_program_of_ones_own_is_as_good(defines_programs):
    @dataclass(frozen=True)
    class Jolt(Program):
        name = "jolt"
        pieces = (Linear(float("inf"), rate="rate"),)

    assert make_grid(Jolt(), rate=[1, 2], modulus_ratio=4).dims == ("rate",)
    with pytest.raises(ValueError, match="field = 1 is not a parameter of the program 'jolt', which takes rate and"):
        make_grid(Jolt(), field=1, rate=1, modulus_ratio=4)


MULTI_INDEX = along("a", "b").stack(sample=("a", "b"))


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({}, ValueError, "field is missing for the program 'step', which takes field and modulus_ratio"),
        ({"field": 1, "rate": 2}, ValueError, "rate = 2 is not a parameter of the program 'step'"),
        ({"field": 1, "modulus_ratio": None}, ValueError, "modulus_ratio is missing"),
        (
            {"field": 1, "modulus_ratio": 0.999},
            ValueError,
            "modulus_ratio must be finite and at least 1; got 0.999",
        ),
        ({"field": [1, -0.5]}, ValueError, "field must be finite and at least 0; got -0.5"),
        ({"field": float("nan")}, ValueError, "field must be finite and at least 0; got nan"),
        ({"field": along("a") * np.inf}, ValueError, "field must be finite and at least 0; got inf"),
        ({"field": np.ma.array([1, 2], mask=[0, 1])}, ValueError, "field must have no masked values"),
        ({"field": np.ones((2, 2))}, ValueError, r"field must be a number or a 1-D array; .* \(2, 2\)"),
        ({"field": True}, TypeError, "field must be a real number.*got True of type bool"),
        ({"field": [1.0, True]}, TypeError, r"field must be a real number.*got \[1.0, True\] with a bool"),
        ({"field": np.array([True])}, TypeError, "field must be a real number.*of type bool"),
        ({"field": "1"}, TypeError, "field must be a real number.*got '1'"),
        ({"field": 1j}, TypeError, "field must be a real number.*got 1j"),
        ({"field": [1, None]}, TypeError, "field must be a real number"),
        ({"field": [[1], [1, 2]]}, TypeError, "field must be a real number"),
        ({"field": 10**400}, TypeError, "field must be a real number"),
        ({"field": {"start": 1}}, TypeError, "field must be a real number"),
        (
            {"field": along("a").assign_attrs(units="MV/m")},
            ValueError,
            "field must be dimensionless.*got units 'MV/m'",
        ),
        ({"field": along("a").rename(a=0)}, TypeError, "field must name its dimensions.*by strings; got 0"),
        (
            {"field": along("a").rename(a="outcome")},
            ValueError,
            "field has a dimension or coordinate 'outcome'",
        ),
        ({"field": along("a", time=0.0)}, ValueError, "field has a dimension or coordinate 'time'"),
        (
            {"field": along("a", "b").rename(a="field")},
            ValueError,
            "field can have the dimension 'field' only alone",
        ),
        (
            {"field": along("a", a=[5, 6]).rename(a="field")},
            ValueError,
            "field differs from its coordinate 'field'",
        ),
        (
            {"field": along("a").rename(a="modulus_ratio")},
            ValueError,
            "field has a dimension 'modulus_ratio'",
        ),
        ({"field": MULTI_INDEX}, ValueError, "field has a multi-index"),
        (
            {"field": along("a"), "modulus_ratio": along("b").rename(b="a")},
            ValueError,
            "field and modulus_ratio must have the same length along their common dimension 'a'; got 2 and 3",
        ),
        (
            {"field": along("a", a=[1, 2]), "modulus_ratio": along("a", a=[1, 3])},
            ValueError,
            "field and modulus_ratio must have the same coordinate along their common dimension 'a'",
        ),
    ],
)
def test_bad_input_is_refused_in_one_line(arguments, error, message):
    with pytest.raises(error, match=message) as caught:
        make_grid(dm.Step(), **{"modulus_ratio": 4, **arguments})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("rate", [0, -1.0])
def test_rate_is_above_zero(rate):
    with pytest.raises(ValueError, match="rate must be finite and above 0; got"):
        make_grid(dm.Ramp(), rate=rate, modulus_ratio=4)


def test_bounds_themselves_are_allowed():
    make_grid(dm.Step(), field=0, modulus_ratio=1)


@pytest.mark.parametrize("program", [dm.Step, "step", None])
def test_the_program_is_an_instance(program):
    with pytest.raises(TypeError, match=r"program must be a loading program, one of Step\(\), Ramp\(\), RampHold\(\)"):
        make_grid(program, field=1, modulus_ratio=4)


def test_more_cells_than_an_index_can_count_are_refused():
    many = np.ones(3_000_000)
    with pytest.raises(MemoryError, match=r"3000000 x 3000000 x 3000000 = 2.7e\+19 cells are more than"):
        make_grid(dm.RampHold(), field=many, rate=many, modulus_ratio=many)
