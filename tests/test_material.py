"""Materials: their numbers, what follows from them, and what is refused."""

import dataclasses

import pytest

import dea_maps as dm


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
        ({"name": 3}, TypeError, "name must be a string; got 3"),
    ],
)
def test_bad_numbers_are_refused(changes, error, words):
    given = {"unrelaxed_modulus": 2e5, "relaxed_modulus": 1e5, "relaxation_time": 10.0, **changes}
    with pytest.raises(error, match=words):
        dm.Material(**given)
