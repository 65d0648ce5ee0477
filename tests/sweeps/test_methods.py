"""The methods on offer, and what is refused before anything is computed."""

import numpy as np
import pytest

import dea_maps as dm
from dea_maps.programs import PROGRAMS
from dea_maps.sweeps.methods import choose

MADE = {
    "sequence": dm.Sequence([dm.Jump("field"), dm.Hold(1.0), dm.Jump(0.5)]),
    "waveform": dm.Waveform([0, 1], [0, 1]),
}
ONE_OF_EACH = [MADE[name] if name in MADE else cls() for name, cls in PROGRAMS.items()]


def test_methods_say_what_they_are():
    for method in dm.methods():
        assert method.name and method.kind and method.region and method.source
        assert method.order >= 0
        assert set(method.programs) <= set(PROGRAMS)
        assert set(method.formulations) == set(method.serves)
        assert all(set(names) <= set(PROGRAMS) for names in method.serves.values())


def test_methods_print_as_a_table():
    lines = str(dm.methods()).splitlines()
    assert len(lines) == 1 + len(dm.methods())
    starts = [lines[0].index(word) for word in lines[0].split()]
    for line, method in zip(lines[1:], dm.methods(), strict=True):
        cells = [line[start:end].strip() for start, end in zip(starts, [*starts[1:], None], strict=True)]
        listed = [", ".join(names) for names in (method.formulations, method.programs)]
        assert cells == [method.name, str(method.order or "any"), method.kind, *listed]


def test_names_are_unique():
    names = [method.name for method in dm.methods()]
    assert len(set(names)) == len(names)


def test_orders_are_the_nominal_ones():
    orders = {method.name: method.order for method in dm.methods()}
    assert (orders["rk4"], orders["dopri5"], orders["dop853"], orders["radau5"]) == (4, 5, 8, 5)


@pytest.mark.parametrize("program", ONE_OF_EACH, ids=lambda program: program.name)
def test_auto_serves_every_program_and_never_takes_the_rate_form(program):
    choice = choose(program, "auto", "auto", 1e-6, None)
    served = {method.name: method.serves for method in dm.methods()}
    assert program.name in served[choice.method][choice.formulation]
    assert choice.formulation != "rate"
    assert (choice.rtol, choice.step) == (1e-6, None)


@pytest.mark.parametrize("program", ONE_OF_EACH, ids=lambda program: program.name)
def test_every_method_is_chosen_by_name_on_every_formulation_that_serves(program):
    for method in dm.methods():
        fixed = method.kind.endswith("fixed step")
        for formulation, names in method.serves.items():
            if program.name in names:
                choice = choose(program, method.name, formulation, 1e-6, 0.01 if fixed else None)
                assert (choice.method, choice.formulation) == (method.name, formulation)
                assert (choice.rtol is None) == fixed


def test_a_formulation_alone_finds_a_method_that_serves_it():
    choice = choose(dm.Step(), "auto", "rate", 1e-6, None)
    assert (choice.method, choice.formulation) == ("dop853", "rate")


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"rtol": 1e-13}, ValueError, ("rtol", "1e-13", "1e-12", "0.001")),
        ({"rtol": 2e-3}, ValueError, ("rtol", "0.002", "1e-12", "0.001")),
        ({"rtol": float("nan")}, ValueError, ("rtol", "nan")),
        ({"rtol": "tight"}, TypeError, ("rtol", "tight", "number")),
        ({"rtol": True}, TypeError, ("rtol", "True", "number")),
        ({"method": "rk5"}, ValueError, ("method", "rk5", "'rk4'", "nearest")),
        ({"method": 5}, TypeError, ("method", "5", "string")),
        ({"formulation": "folds"}, ValueError, ("formulation", "folds", "'fold'", "nearest")),
        ({"method": "quadrature", "formulation": "fold"}, ValueError, ("formulation", "'stretch'", "'fold'")),
        ({"method": "rk4"}, ValueError, ("step", "rk4")),
        ({"method": "rk4", "step": 0.0}, ValueError, ("step", "0.0", "above 0")),
        ({"method": "rk4", "step": float("inf")}, ValueError, ("step", "inf", "finite")),
        ({"method": "rk4", "step": "long"}, TypeError, ("step", "long", "number")),
        ({"method": "dopri5", "step": 0.1}, ValueError, ("step", "dopri5", "0.1")),
        ({"step": 0.1}, ValueError, ("step", "0.1", "'rk4'")),
    ],
)
def test_refusals_name_the_parameter_the_value_and_what_is_allowed(change, error, words, monkeypatch):
    monkeypatch.setattr("dea_maps.runs.maps.solve", lambda *args, **kwargs: pytest.fail("computed"))
    with pytest.raises(error) as refusal:
        dm.sweep(dm.Step(), field=1.2, modulus_ratio=4.0, **change)
    message = str(refusal.value)
    assert "\n" not in message
    for word in words:
        assert word in message


def test_a_method_that_does_not_serve_the_program_is_refused():
    with pytest.raises(ValueError, match=r"method must be one of .*; got 'quadrature'"):
        dm.sweep(dm.Ramp(), rate=1.0, modulus_ratio=4.0, method="quadrature")
    with pytest.raises(ValueError, match="formulation"):
        dm.sweep(dm.Step(), field=1.2, modulus_ratio=4.0, method="dop853", formulation="area")


def test_numpy_numbers_are_numbers():
    choice = choose(dm.Ramp(), "auto", "auto", np.float32(1e-3), None)
    assert isinstance(choice.rtol, float)


def test_a_step_that_leads_nowhere_is_refused_before_computing():
    with pytest.raises(ValueError, match=r"step must be at least 1e-09: .*; got 1e-12"):
        choose(dm.Step(), "rk4", "auto", 1e-6, 1e-12)


def test_one_method_serves_a_rising_field_under_a_dead_load():
    for program in (dm.Ramp(), dm.RampHold()):
        choice = choose(program, "auto", "auto", 1e-6, None, True)
        assert (choice.method, choice.formulation) == ("dop853", "area")
        for method in ("dopri5", "radau5"):
            with pytest.raises(ValueError, match="must be one of"):
                choose(program, method, "area", 1e-6, None, True)
