"""The fit to uniaxial tension: finds what the curves were made of, and how well it knows it."""

import tomllib

import numpy as np
import pytest
import xarray as xr
from scipy.stats import binom

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.materials.uniaxial import uniaxial_stress

RATES = np.array([1e-4, 1e-3, 1e-2, 1e-1])  # per s
STRETCH = np.linspace(1.25, 5.0, 16)
TRUE = {"unrelaxed_modulus": 87.8e3, "relaxed_modulus": 22.8e3, "relaxation_time": 200.0, "modulus_ratio": 87.8 / 22.8}
REPETITIONS = 10
HEAD = "stretch_rate,stretch,nominal_stress\n"


def made(rates=RATES):
    """Return curves of the model at the paper's values."""
    stress = 22.8e3 * uniaxial_stress(STRETCH, rates * 200.0, TRUE["modulus_ratio"])
    return xr.Dataset(
        {"nominal_stress": (("stretch_rate", "stretch"), stress)}, {"stretch_rate": rates, "stretch": STRETCH}
    )


def noisy(level, seed, noise="proportional", rates=RATES):
    curves = made(rates)
    size = curves.nominal_stress if noise == "proportional" else float(curves.nominal_stress.max())
    scatter = np.random.default_rng(seed).standard_normal(curves.nominal_stress.shape)
    return curves.assign(nominal_stress=curves.nominal_stress + level * size * scatter)


def test_stress_is_that_of_the_general_model():
    for rate in (0.02, 0.5, 20.0):
        pull = dm.LoadHistory((0.0, 4.0 / rate), (1.0, 5.0))
        times = (STRETCH - 1.0) / rate
        full = dm.general_trajectory(time=times, modulus_ratio=4.0, stretch_1=pull, rtol=1e-9)
        np.testing.assert_allclose(uniaxial_stress(STRETCH, np.array([rate]), 4.0)[0], full.stress_1, rtol=1e-6)


def test_exact_curves_give_the_material_back():
    fit = dm.fit_uniaxial(made(), name="VHB", source="a test")
    for name, value in TRUE.items():
        assert getattr(fit.material, name) == pytest.approx(value, rel=1e-5)
    assert fit.material.relative_permittivity is None
    assert (fit.material.name, fit.material.source) == ("VHB", "a test")
    assert all(fit.determined.values())
    np.testing.assert_allclose(fit.curves.fitted_stress, fit.curves.nominal_stress, rtol=1e-6)


@pytest.mark.parametrize("level", [0.01, 0.05])
@pytest.mark.parametrize("noise", ["constant", "proportional"])
def test_intervals_hold_the_truth_as_often_as_they_say(level, noise):
    """A right interval misses more often than the bound in one of ten thousand such tests."""
    inside = dict.fromkeys(TRUE, 0)
    scatter = []
    for seed in range(REPETITIONS):
        fit = dm.fit_uniaxial(noisy(level, seed, noise), noise=noise)
        scatter.append(fit.scatter)
        for name, (low, high) in fit.intervals.items():
            inside[name] += low <= TRUE[name] <= high
    fewest = binom.ppf(1e-4, REPETITIONS, 0.95)
    assert min(inside.values()) >= fewest > 0.5 * REPETITIONS
    unit = float(made().nominal_stress.max()) if noise == "constant" else 1.0
    assert np.mean(scatter) == pytest.approx(level * unit, rel=0.1)
    assert fit.intervals["relaxed_modulus"][1] / fit.intervals["relaxed_modulus"][0] < 1.0 + 6.0 * level


def test_one_rate_does_not_determine_the_relaxation_time():
    fit = dm.fit_uniaxial(noisy(0.01, seed=1, rates=RATES[1:2]))
    assert not fit.determined["relaxation_time"]
    line = next(line for line in fit.summary().splitlines() if line.startswith("relaxation_time"))
    assert "NOT DETERMINED" in line
    assert "one stretch rate cannot determine the relaxation time" in fit.summary()


def test_rates_far_too_fast_do_not_either():
    fit = dm.fit_uniaxial(noisy(0.02, seed=2, rates=np.array([10.0, 100.0])))
    assert not fit.determined["relaxation_time"]
    assert not fit.determined["relaxed_modulus"]
    assert "NOT DETERMINED" in fit.summary()


def test_kilopascals_gaps_and_order():
    curves = made()
    gaps = curves.nominal_stress.where((curves.stretch < 4.0) | (curves.stretch_rate > 1e-3))
    other = (gaps / 1e3).assign_attrs(units="kPa").isel(stretch=slice(None, None, -1)).to_dataset(name="nominal_stress")
    fit = dm.fit_uniaxial(other)
    assert fit.curves.sizes["point"] < curves.nominal_stress.size
    assert fit.material.relaxation_time == pytest.approx(200.0, rel=1e-4)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda ds: ds.to_dataframe(), TypeError, "curves must be an xarray.Dataset"),
        (lambda ds: ds.drop_vars("stretch_rate"), ValueError, "stretch_rate is missing"),
        (
            lambda ds: ds.assign_coords(stretch=ds.stretch - 1),
            ValueError,
            "stretch must be finite and at least 1; got 0.25",
        ),
        (
            lambda ds: ds.assign_coords(stretch_rate=-ds.stretch_rate),
            ValueError,
            "stretch_rate must be finite and above 0",
        ),
        (lambda ds: ds.isel(stretch=[0], stretch_rate=[0, 1]), ValueError, "at least 4 points"),
        (lambda ds: -ds, ValueError, "nominal_stress must be above 0 somewhere"),
        (lambda ds: ds.astype(str), ValueError, "nominal_stress must be made of real numbers"),
    ],
)
def test_bad_curves_are_refused(change, error, words):
    with pytest.raises(error, match=words):
        dm.fit_uniaxial(change(made()))


def test_unknown_noise_and_units_are_refused():
    with pytest.raises(ValueError, match="noise must be one of constant, proportional; got 'white'"):
        dm.fit_uniaxial(made(), noise="white")
    curves = made()
    curves.nominal_stress.attrs["units"] = "psi"
    with pytest.raises(ValueError, match="nominal_stress must be in Pa, kPa or MPa; got units 'psi'"):
        dm.fit_uniaxial(curves)


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frame = noisy(0.01, seed=3).to_dataframe().reset_index()
    (tmp_path / "data.csv").write_text("# made\n" + frame.to_csv(index=False))
    return tmp_path


def test_command_line_fits_and_draws(table, capsys):
    assert main(["fit", "data.csv", "-o", "fit.png", "--noise", "proportional"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    for words in ("64 points at 4 stretch rates", "relaxation_time", "95 % interval", "% of the stress"):
        assert words in captured.out
    assert (table / "fit.png").read_bytes().startswith(b"\x89PNG")


def test_what_is_printed_is_a_material_to_design_with(table, capsys):
    assert main(["fit", "data.csv", "--noise", "proportional"]) == 0
    lines = capsys.readouterr().out.partition("[material]\n")[2].splitlines()
    assert lines[-1] == "# relative_permittivity = ...  # not known from tension"
    known = ["[material]", *lines[:-1], "relative_permittivity = 4.7"]
    (table / "film.toml").write_text("\n".join(known))
    material = dm.read_material("film.toml")
    assert (material.name, material.source) == ("data", "fit to tension, data.csv")
    assert material.relaxation_time == pytest.approx(dm.VHB.relaxation_time, rel=0.1)
    (table / "design.toml").write_text("\n".join([*known, "thickness = 50e-6", "[design]", "holding_time = 3600"]))
    assert main(["design", "design.toml"]) == 0
    assert "data, 50 um" in capsys.readouterr().out


def test_what_is_printed_can_be_read_as_a_whole(table, capsys):
    assert main(["fit", "data.csv"]) == 0
    printed = capsys.readouterr().out
    assert "# 64 points at 4 stretch rates" in printed
    assert list(tomllib.loads(printed)["material"])[2:] == ["unrelaxed_modulus", "relaxed_modulus", "relaxation_time"]
    (table / "film.toml").write_text("old")
    assert main(["fit", "data.csv", "--material", "film.toml"]) == 0
    summary = capsys.readouterr().out
    assert summary.startswith("64 points at 4 stretch rates")
    assert "[material]" not in summary
    assert tomllib.loads((table / "film.toml").read_text()) == tomllib.loads(printed)


def test_what_is_not_determined_is_not_offered(table, capsys):
    lines = (table / "data.csv").read_text().splitlines()
    one_rate = [line for line in lines if line.startswith(("#", "stretch_rate", "0.01,"))]
    assert len(one_rate) == 18
    (table / "one.csv").write_text("\n".join(one_rate))
    assert main(["fit", "one.csv", "--material", "film.toml"]) == 0
    assert "relaxation_time" in capsys.readouterr().out
    assert "# relaxation_time = ...  # s; not determined by the curves\n" in (table / "film.toml").read_text()
    with pytest.raises(ValueError, match=r"film.toml: \[material\] must have the key '.*'; it is missing"):
        dm.read_material("film.toml")


def test_the_data_are_not_replaced(table, capsys):
    before = (table / "data.csv").read_text()
    assert main(["fit", "data.csv", "--material", "data.csv"]) == 2
    assert "cannot write data.csv: it is the data itself" in capsys.readouterr().err
    assert (table / "data.csv").read_text() == before


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "there is no file other.csv"),
        ("", "other.csv: its first line must name the columns stretch_rate, stretch, nominal_stress, each once"),
        (
            "stretch_rate,stretch,nominal_stress\n0.1,1.2,much\n",
            "line 2 must have a number for nominal_stress; got 'much'",
        ),
        ("stretch_rate,stretch,nominal_stress\n0.1,1.2\n", "line 2 must have a number for nominal_stress; got ''"),
        (
            "stretch_rate,stretch,nominal_stress\n0.1,0.9,1e3\n",
            "other.csv: stretch must be finite and at least 1; got 0.9",
        ),
        (HEAD + "0.1,1.2,1_5\n", "other.csv: line 2 must have a number for nominal_stress; got '1_5'"),
        (HEAD + "0.1,1.2,१५\n", "other.csv: line 2 must have a number for nominal_stress; got '१५'"),
        (HEAD + "0.1,1.2," + 10_000 * "x" + "\n", "line 2 must have a number for nominal_stress; got 'xxxx"),
        (HEAD + "# more\n\n0.1,1.2," + 200_000 * "1" + "\n", "other.csv: line 4 cannot be read: field larger than"),
        (HEAD + '0.1,1.2,"1\n5"\n', r"other.csv: line 3 must have a number for nominal_stress; got '1\n5'"),
        (HEAD + "0.1,1e200,1e3\n", "other.csv: stretch must be from 1 to 1000; got 1e+200"),
        (HEAD + "1e-300,1.2,1e3\n", "other.csv: stretch_rate must be from 1e-12 to 1e+12; got 1e-300"),
        (HEAD + "0.1,1.2,1e300\n", "other.csv: nominal_stress must be from -1e+15 to 1e+15; got 1e+300"),
    ],
)
def test_bad_tables_end_with_2_and_one_line(table, capsys, text, words):
    if text is not None:
        (table / "other.csv").write_text(text, encoding="utf-8")
    assert main(["fit", "other.csv"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert len(captured.err) < 200
    assert words in captured.err
    assert main(["fit", "data.csv", "-o", "fit.gif"]) == 2
    assert "a chart must be a file ending in .png, .svg, .pdf; got fit.gif" in capsys.readouterr().err
