"""Loading programs: names, parameters, registry, pieces, and what is refused."""

import dataclasses
import math
import pickle

import numpy as np
import pytest

import dea_maps as dm
from dea_maps.nomenclature import KINDS, PARAMETERS
from dea_maps.pieces import Hold, Jump, Linear, Share, Sine
from dea_maps.program_text import attributes_of, piece_of, program_of, table_of
from dea_maps.programs import PROGRAMS, Program, PulseTrain, Sequence, Waveform

BUILT_IN = {
    "step": ("field",),
    "ramp": ("rate",),
    "ramp_hold": ("field", "rate"),
    "pulse": ("field", "width"),
    "trapezoid": ("field", "rate", "hold_time", "fall_rate"),
    "overdrive": ("field", "overdrive_field", "overdrive_time"),
    "pulse_train": ("field", "period", "duty"),
    "triangle_train": ("field", "period"),
    "biased_sine": ("bias", "amplitude", "period"),
}
REST = [Linear("field", time=2.0), Hold("hold_time"), Linear(0.0, time=2.0), Hold(60.0)]


@pytest.mark.parametrize(("name", "parameters"), BUILT_IN.items())
def test_name_and_parameters(name, parameters):
    program = PROGRAMS[name]()
    assert (program.name, program.parameters) == (name, parameters)
    assert set(parameters) <= set(PARAMETERS)
    assert all(program.kinds[key] == PARAMETERS[key].kind for key in parameters)


def test_registry_holds_every_program_by_its_own_name():
    own = {program for program in Program.__subclasses__() if program.__module__ == Program.__module__}
    # Programs that other tests define, as users may, enter as well.
    registered = {name: program for name, program in PROGRAMS.items() if program.__module__ == Program.__module__}
    assert set(registered.values()) == own
    assert set(registered) == {*BUILT_IN, "sequence", "waveform"}
    assert all(name == program.name for name, program in PROGRAMS.items())


def test_programs_are_frozen_and_equal_by_value():
    assert dm.Step() == dm.Step()
    assert dm.Step() != dm.Ramp()
    assert Sequence(REST) == Sequence(list(REST)) != Sequence(REST, repeat=2)
    assert Waveform([0, 1], [0, 1]) == Waveform((0.0, 1.0), np.arange(2)) != Waveform([0, 1], [1, 0])
    with pytest.raises(dataclasses.FrozenInstanceError):
        dm.Step().name = "jump"
    with pytest.raises(ValueError, match="read-only"):
        Waveform([0, 1], [0, 1]).values[0] = 2.0


def test_a_sequence_has_the_parameters_that_its_pieces_name_in_the_order_of_their_use():
    program = Sequence([Linear("peak", rate="up"), Sine("ripple", "period", cycles=3), Hold(Share("duty", "period"))])
    assert dict(program.kinds) == {
        "peak": "field", "up": "rate", "ripple": "field", "period": "period", "duty": "share"
    }  # fmt: skip


@pytest.mark.parametrize("program", [*(PROGRAMS[name]() for name in BUILT_IN), Sequence(REST, repeat=True)], ids=repr)
def test_a_program_survives_pickling_and_the_attributes_of_a_file(program):
    assert pickle.loads(pickle.dumps(program)) == program
    assert program_of(attributes_of(program)) == program


def test_a_waveform_survives_them_too():
    program = Waveform(np.linspace(0, 9, 50), np.sin(np.arange(50.0)), repeat=True)
    assert pickle.loads(pickle.dumps(program)) == program
    assert program_of(attributes_of(program)) == program


def test_a_waveform_with_more_samples_than_a_file_holds_is_named_but_not_given_back():
    long = Waveform(np.arange(5000.0), np.ones(5000))
    with pytest.raises(ValueError, match="up to 4000"):
        program_of(attributes_of(long))


@pytest.mark.parametrize("piece", [*PulseTrain.pieces, *REST, Jump("x"), Sine("a", 2.0, 5), Linear(math.inf, rate=1)])
def test_pieces_survive_their_text(piece):
    assert piece_of(table_of(piece), "piece 1") == piece


def test_pieces_may_be_in_si_units():
    units = {"time": 1 / 200.0, "field": 1 / 1600.0, "rate": 200.0 / 1600.0}
    assert piece_of({"hold_seconds": 50.0}, "piece 1", units) == Hold(0.25)
    assert piece_of({"linear_to_voltage": 800.0, "voltage_rate": 16.0}, "piece 1", units) == Linear(0.5, rate=2.0)
    assert piece_of({"linear_to_voltage": "peak", "time_seconds": "up"}, "p", units) == Linear("peak", time="up")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Sequence([]), "at least one Jump, Linear or Sine"),
        (lambda: Sequence([Hold(1.0), Jump(0.0)]), "at least one Jump, Linear or Sine"),
        (lambda: Sequence([Jump(1.0)], repeat=0), "repeat must be True, False or at least 1; got 0"),
        (lambda: Sequence([Jump("x"), Hold("x")]), "'x' is used both as a field and as a time"),
        (lambda: Sequence([Linear(math.inf, rate=1.0), Hold(1.0)]), "nothing can follow"),
        (
            lambda: Sequence([Sine("x", 1.0, 1.25)], repeat=2),
            "must have a Jump or a Linear, or Sines of half and whole",
        ),
        (lambda: Linear(1.0), "either rate or time; got neither"),
        (lambda: Linear(1.0, rate=1.0, time=1.0), "either rate or time; got both"),
        (lambda: Linear(1.0, rate=0.0), "rate of Linear must be finite and above 0; got 0.0"),
        (lambda: Hold(-1.0), "time of Hold must be finite and at least 0; got -1.0"),
        (lambda: Hold(math.inf), "time of Hold must be finite and at least 0; got inf"),
        (lambda: Jump(math.nan), "to of Jump must be finite and at least 0; got nan"),
        (lambda: Jump("rtol"), "'rtol', a name that the sweep itself uses"),
        (lambda: Jump("2 kV"), "a number or the name of a parameter; got '2 kV'"),
        (lambda: Sine(1.0, 0.0), "period of Sine must be finite and above 0; got 0.0"),
        (lambda: Share(1.5, of="period"), "share of Share must be from 0 to 1; got 1.5"),
        (lambda: Waveform([0.0], [1.0]), "at least 2 samples; got 1"),
        (lambda: Waveform([0, 2, 1], [0, 1, 1]), "times must rise; got 1.0 after 2.0"),
        (lambda: Waveform([0, 1, 1], [0, 1, 1]), "times must rise; got 1.0 after 1.0"),
        (lambda: Waveform([1, 2], [0, 1]), "times must begin at 0; got 1.0"),
        (lambda: Waveform([0, 1], [0, math.nan]), "values must be finite; got nan"),
        (lambda: Waveform([0, 1], [0, 0]), "values must load the film"),
        (lambda: Waveform([0, 1, 2], [0, 1]), "the same length; got 3 and 2"),
        (lambda: piece_of({}, "piece 1"), "piece 1 must have one of hold, linear_to, jump_to, sine; got none"),
        (lambda: piece_of({"hold": 1, "jump_to": 2}, "piece 1"), "piece 1 must have one of"),
        (lambda: piece_of({"linear_to": 1, "rat": 2}, "piece 1"), "piece 1 has the unknown key 'rat'"),
        (lambda: piece_of({"hold_seconds": 1}, "piece 1"), "got 'hold_seconds'"),
        (lambda: program_of({}), "the attribute 'program' must be one of"),
        (lambda: program_of({"program": "sequence"}), "not those of this package"),
    ],
)
def test_bad_programs_are_refused_in_one_line(make, said):
    with pytest.raises(ValueError, match=said) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Sequence("pieces"),
        lambda: Sequence([3.0]),
        lambda: Sequence([Jump(1.0)], repeat="yes"),
        lambda: Hold(True),
        lambda: Jump(None),
        lambda: Waveform("t", "v"),
        lambda: Waveform([0, 1], [0, 1], repeat=2),
        lambda: piece_of("hold", "piece 1"),
    ],
)
def test_what_is_of_the_wrong_kind_is_refused(make):
    with pytest.raises(TypeError):
        make()


def test_twins_in_si_units_follow_one_rule():
    twins = {name: KINDS[kind.kind].twin(name) for name, kind in PARAMETERS.items()}
    assert twins == {
        "field": "voltage",
        "rate": "voltage_rate",
        "overdrive_field": "overdrive_voltage",
        "bias": "bias_voltage",
        "amplitude": "amplitude_voltage",
        "width": "width_seconds",
        "hold_time": "hold_time_seconds",
        "fall_rate": "fall_voltage_rate",
        "overdrive_time": "overdrive_time_seconds",
        "period": "period_seconds",
        "stress": "nominal_stress",
        "duty": None,
        "modulus_ratio": None,
        "prestretch": None,
    }
