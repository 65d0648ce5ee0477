"""Loading programs: names, parameters, registry."""

import dataclasses

import pytest

import dea_maps as dm
from dea_maps.nomenclature import PARAMETERS
from dea_maps.programs import PROGRAMS, Program


@pytest.mark.parametrize(
    ("program", "name", "parameters"),
    [
        (dm.Step(), "step", ("field",)),
        (dm.Ramp(), "ramp", ("rate",)),
        (dm.RampHold(), "ramp_hold", ("field", "rate")),
    ],
)
def test_name_and_parameters(program, name, parameters):
    assert (program.name, program.parameters) == (name, parameters)
    assert PROGRAMS[name] is type(program)


def test_programs_are_frozen_and_equal_by_value():
    assert dm.Step() == dm.Step()
    assert dm.Step() != dm.Ramp()
    with pytest.raises(dataclasses.FrozenInstanceError):
        dm.Step().name = "jump"


def test_registry_holds_every_program_by_its_own_name():
    assert set(PROGRAMS.values()) == set(Program.__subclasses__())
    for name, program in PROGRAMS.items():
        assert name == program.name
        assert set(program.parameters) <= set(PARAMETERS)
