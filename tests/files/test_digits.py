"""Maps rounded to the bits that their accuracy carries."""

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.files import engines, stream
from dea_maps.files.digits import bits_of, rounded

CUBE = {"field": np.linspace(0.8, 2.2, 13), "rate": np.geomspace(1e-3, 1e3, 11), "modulus_ratio": np.linspace(2, 6, 7)}
SPEC = """
[program]
name = "step"
[grid]
field = { start = 0.8, stop = 2.2, num = 40 }
modulus_ratio = [2.0, 4.0]
"""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "map.nc"


@pytest.mark.parametrize("kind", ["float32", "float64"])
@pytest.mark.parametrize("bits", [1, 7, 16, 22])
def test_rounding_is_to_the_nearest(kind, bits):
    """Against mantissas and exponents, the former rounded as numbers, of two that are as near to the even one."""
    rng = np.random.default_rng(bits)
    limits = np.finfo(kind)
    values = (rng.choice([-1, 1], 5000) * np.exp2(rng.uniform(limits.minexp, limits.maxexp - 1, 5000))).astype(kind)
    ties = (np.arange(1, 200, 2) / 2 ** (bits + 1) + 1).astype(kind)
    values = np.concatenate([values, ties[ties < 2.0]])
    mantissa, exponent = np.frexp(values.astype(np.longdouble))
    expected = np.ldexp(np.rint(mantissa * 2 ** (bits + 1)) / 2 ** (bits + 1), exponent)
    found = rounded(values, bits)
    assert found.dtype == kind
    np.testing.assert_array_equal(found, expected.astype(kind))
    assert np.any(found != values)


@pytest.mark.parametrize("kind", ["float32", "float64"])
def test_what_is_no_normal_number_stays(kind):
    limits = np.finfo(kind)
    values = np.array([np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0, limits.smallest_subnormal, limits.max, -limits.max])
    values = values.astype(kind)
    whole = values.view(f"u{values.dtype.itemsize}")
    every_nan = np.array([np.uint64(0x7FFFFFFFFFFFFFFF), np.uint64(0xFFFFFFFFFFFFFFFF)]).view(np.float64)
    np.testing.assert_array_equal(rounded(values, 12).view(whole.dtype), whole)
    assert np.isnan(rounded(every_nan, 12)).all()


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-10])
def test_as_few_bits_as_the_error_allows(rtol):
    assert 2.0 ** -(bits_of(rtol) + 1) <= rtol / 8 < 2.0 ** -bits_of(rtol)


@pytest.mark.parametrize(("dtype", "rtol"), [("float64", 1e-6), ("float32", 1e-4)])
def test_a_rounded_map(dtype, rtol, path, tmp_path):
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, rtol=rtol, dtype=dtype, digits="auto")
    dm.sweep_to_netcdf(tmp_path / "all.nc", dm.RampHold(), **CUBE, rtol=rtol, dtype=dtype)
    found, every = xr.load_dataset(path), xr.load_dataset(tmp_path / "all.nc")
    np.testing.assert_array_equal(found.outcome, every.outcome)
    for name in set(every.data_vars) - {"outcome"}:
        assert found[name].attrs.pop("quantization") == "quantization_info"
        bits = found[name].attrs.pop("quantization_nsb")
        assert found[name].attrs == every[name].attrs
        np.testing.assert_allclose(found[name], every[name], rtol=rtol / 8, equal_nan=True)
        mantissa, _ = np.frexp(found[name].values.astype(np.float64))
        kept = np.nan_to_num(mantissa) * 2.0 ** (bits + 1)
        np.testing.assert_array_equal(kept, np.rint(kept))
    assert found.quantization_info.attrs == {
        "algorithm": "bitround",
        "implementation": f"dea_maps version {dm.__version__}",
    }
    assert found.attrs.pop("Conventions") == "CF-1.12, ACDD-1.3"
    assert every.attrs.pop("Conventions") == "CF-1.11, ACDD-1.3"
    assert found.attrs == every.attrs


def test_a_rounded_file_is_smaller(tmp_path):
    sizes = []
    for digits in (None, "auto"):
        path = tmp_path / f"{digits}.nc"
        films = {"field": np.linspace(1.1, 2.2, 60), "modulus_ratio": np.linspace(2.0, 6.0, 500)}
        dm.sweep_to_netcdf(path, dm.Step(), **films, digits=digits)
        sizes.append(path.stat().st_size)
    assert sizes[1] < 0.6 * sizes[0]


def test_nothing_to_round(path):
    """Of a number in single precision, 1e-8 carries more bits than there are."""
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, rtol=1e-8, dtype="float32", digits="auto")
    found = xr.load_dataset(path)
    assert "quantization_info" not in found and found.attrs["Conventions"] == "CF-1.11, ACDD-1.3"


def test_counts_stay(path):
    asked = {"field": [1.3, 1.5], "duty": 0.5, "period": 0.01, "modulus_ratio": 4.0}
    dm.sweep_to_netcdf(path, dm.PulseTrain(), **asked, rtol=1e-3, digits="auto")
    counts = dm.sweep(dm.PulseTrain(), **asked, rtol=1e-3).cycles_to_failure
    found = xr.load_dataset(path)
    xr.testing.assert_identical(found.cycles_to_failure, counts)
    assert found.time_to_failure.attrs["quantization_nsb"] == bits_of(1e-3)


def test_si_units_are_rounded_too(path):
    asked = {"voltage": np.linspace(1000.0, 3000.0, 20), "material": dm.VHB, "thickness": 1e-4}
    dm.sweep_to_netcdf(path, dm.Step(), **asked, rtol=1e-4, digits="auto")
    exact = dm.sweep(dm.Step(), **asked, rtol=1e-4)
    with dm.open(path) as found:
        assert found.seconds_to_failure.attrs["quantization_nsb"] == bits_of(1e-4)
        for name in ("seconds_to_failure", "time_to_failure"):
            np.testing.assert_allclose(found[name], exact[name], rtol=1e-4 / 8)
            assert np.any(found[name] != exact[name])


def test_parts_of_other_digits_are_not_taken(path, monkeypatch):
    monkeypatch.setattr(stream, "PART_CELLS", 100)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 30)
    real, calls = engines.solve, []

    def solve(*arguments, **options):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(*arguments, **options)

    monkeypatch.setattr(engines, "solve", solve)
    with pytest.raises(KeyboardInterrupt):
        dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE)
    with pytest.warns(UserWarning, match="000000.npz is of another sweep"):
        dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, digits="auto")


def test_the_command_line_and_its_readers(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec.toml").write_text(SPEC)
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--digits", "auto"]) == 0
    assert xr.load_dataset("map.nc").time_to_failure.attrs["quantization_nsb"] == 22
    for verb in (["info", "map.nc"], ["info", "map.nc", "--json"], ["plot", "map.nc", "-o", "chart.svg"]):
        assert main(verb) == 0
    assert "error" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"digits": "all"}, "digits must be 'auto' or None; got 'all'"),
        ({"digits": 7}, "digits must be 'auto' or None; got 7"),
        (
            {"digits": "auto", "method": "rk4", "step": 0.1},
            "digits must be None with a method of fixed step, which has no rtol; got 'auto'",
        ),
    ],
)
def test_digits_that_cannot_be_are_refused(options, message, path):
    with pytest.raises(ValueError, match=message):
        dm.sweep_to_netcdf(path, dm.Step(), field=[0.9, 1.2], modulus_ratio=4.0, **options)
