"""A number that is another one in some recordings: it moves alone, and follows the plant where it was never moved."""

from gateway.catalogue.cylinder import COULOMB
from gateway.diagnosis.bench.parameters import ChangedValue, ModelParameters, reset_parameters
from gateway.twin.plant import Plant, with_value

PLANT = with_value(Plant(), "friction", "coulomb_n", 1.0)
CHANGED = ChangedValue(COULOMB, frozenset({1}))
MODEL = ModelParameters(PLANT, (0.5, 0.7))


def test_a_changed_value_is_that_of_its_recordings_only():
    model = MODEL.with_value(CHANGED, 2.0)
    assert [model.plant_of(k).friction.coulomb_n for k in (0, 1)] == [1.0, 2.0]
    assert [model.plant_of(k).cell.zero_n for k in (0, 1)] == [0.5, 0.7]


def test_what_was_never_changed_follows_the_plant():
    model = MODEL.with_value(COULOMB, 3.0)
    assert model.value(CHANGED) == 3.0 and model.plant_of(1).friction.coulomb_n == 3.0


def test_a_changed_value_stays_when_the_plant_moves():
    model = MODEL.with_value(CHANGED, 2.0).with_value(COULOMB, 3.0)
    assert model.value(CHANGED) == 2.0 and model.value(COULOMB) == 3.0


def test_a_change_that_is_taken_back_follows_the_plant_again():
    model = reset_parameters(MODEL.with_value(CHANGED, 2.0), MODEL, [CHANGED])
    assert model.with_value(COULOMB, 3.0).value(CHANGED) == 3.0


def test_it_is_no_parameter_of_the_plant():
    assert CHANGED.path != COULOMB.path and CHANGED != COULOMB
