"""Materials: their numbers, what follows from them, and what is refused."""

import dataclasses

import numpy as np
import pytest

import dea_maps as dm
from dea_maps.materials.toml import PowerLaw, table_of


def test_vhb_is_that_of_the_paper():
    assert (dm.VHB.unrelaxed_modulus, dm.VHB.relaxed_modulus, dm.VHB.relaxation_time) == (87.8e3, 22.8e3, 200.0)
    assert dm.VHB.modulus_ratio == pytest.approx(3.8509, rel=1e-4)
    assert dm.VHB.critical_field == pytest.approx(0.6873648 * (22.8e3 / (4.7 * 8.8541878e-12)) ** 0.5, rel=1e-6)
    assert "section 4" in dm.VHB.source


def test_permittivity_may_be_unknown():
    material = dm.Material(2e5, 1e5, 10.0)
    with pytest.raises(ValueError, match="relative_permittivity must be known for a critical field; got None"):
        material.critical_field  # noqa: B018
    assert dataclasses.replace(material, relative_permittivity=3.0).critical_field > 0.0


def test_is_frozen_and_equal_by_value():
    material = dm.Material(2, 1, 10)
    assert material == dm.Material(2.0, 1.0, 10.0)
    assert isinstance(material.relaxed_modulus, float)
    with pytest.raises(dataclasses.FrozenInstanceError):
        material.relaxed_modulus = 3.0


def test_a_material_from_a_file(tmp_path):
    path = tmp_path / "film.toml"
    path.write_text(
        "[material]\nunrelaxed_modulus = 2e5\nrelaxed_modulus = 1e5\nrelaxation_time = 10\nrelative_permittivity = 3\n"
        'name = "silicone"\nsource = "a data sheet"\nbreakdown_strength = { at_rest = 3e7, exponent = 1.13 }'
    )
    material = dm.read_material(path)
    assert (material.name, material.source, material.modulus_ratio) == ("silicone", "a data sheet", 2.0)
    expected = [3e7 / material.critical_field, 3e7 * 1.5**1.13 / material.critical_field]
    assert material.strength(np.array([1.0, 1.5])) == pytest.approx(expected)
    path.write_text('[material]\npreset = "VHB"\nbreakdown_strength = 2.5e7')
    changed = dm.read_material(path)
    assert changed == dataclasses.replace(dm.VHB, breakdown_strength=2.5e7)
    assert changed.strength(np.array([1.0, 1.5])) == pytest.approx([2.5e7 / changed.critical_field] * 2)


def test_what_is_wrong_with_a_file_is_said(tmp_path):
    path = tmp_path / "film.toml"
    path.write_text('[material]\npreset = "VHB"\nthickness = 1e-4')
    with pytest.raises(ValueError, match=r"film.toml: \[material\] may have the keys preset, .*; got 'thickness'"):
        dm.read_material(path)
    path.write_text("[materials]")
    with pytest.raises(ValueError, match="the file may have the tables material; got 'materials'"):
        dm.read_material(path)
    with pytest.raises(FileNotFoundError, match="there is no file"):
        dm.read_material(tmp_path / "absent.toml")


@pytest.mark.parametrize(
    "words", ["silicone", 'film "A" \\ of \'23', "Plättchen, 50 µm 🎞", "a\ttab\n\r\x00\x1f\x7f\x85", ""]
)
@pytest.mark.parametrize("strength", [None, 2.5e7, PowerLaw(3.06e7, 1.13)])
def test_a_table_gives_its_material_back(words, strength, tmp_path):
    for permittivity in (None, 4.7):
        material = dm.Material(8.78e4 / 3, 2.28e4 / 3, 1e-17, permittivity, words, words[::-1], strength)
        (tmp_path / "film.toml").write_text(table_of(material), encoding="utf-8", newline="")
        assert dm.read_material(tmp_path / "film.toml") == material


def test_a_function_cannot_be_written():
    with pytest.raises(ValueError, match="breakdown_strength must be a number or a PowerLaw to be written; got <func"):
        table_of(dataclasses.replace(dm.VHB, breakdown_strength=lambda stretch: 3e7 * stretch))


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        (
            {"unrelaxed_modulus": 5e4},
            ValueError,
            "unrelaxed_modulus must be at least relaxed_modulus, 100000; got 50000",
        ),
        ({"relaxed_modulus": 0.0}, ValueError, "relaxed_modulus must be finite and above 0; got 0.0"),
        ({"relaxation_time": float("nan")}, ValueError, "relaxation_time must be finite and above 0; got nan"),
        ({"relaxation_time": "soon"}, TypeError, "relaxation_time must be a real number; got 'soon'"),
        ({"relative_permittivity": 0.5}, ValueError, "relative_permittivity must be None, or finite and at least 1"),
        ({"breakdown_strength": 0.0}, ValueError, "breakdown_strength must be None, a function, or finite and above 0"),
        ({"breakdown_strength": "high"}, TypeError, "breakdown_strength must be a real number; got 'high'"),
        ({"name": 3}, TypeError, "name must be a string; got 3"),
    ],
)
def test_bad_numbers_are_refused(changes, error, words):
    given = {"unrelaxed_modulus": 2e5, "relaxed_modulus": 1e5, "relaxation_time": 10.0, **changes}
    with pytest.raises(error, match=words):
        dm.Material(**given)
