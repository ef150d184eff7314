import pytest

from torquerig.configuration import load_configuration
from torquerig.errors import ConfigurationError
from torquerig.plant_fit.parameters import DEFAULT, PARAMETERS, changed, chosen_parameters, from_unit, to_unit, value_in


@pytest.fixture(scope="module")
def plants():
    return load_configuration().rig.plant


def test_every_parameter_changes_the_plant_and_is_read_back(plants):
    for name, parameter in PARAMETERS.items():
        middle = (parameter.lowest + parameter.highest) / 2
        plant = changed(plants["identified"], [parameter], [middle])
        assert value_in(plant, name) == pytest.approx(middle)
        assert plant != plants["identified"]


def test_the_shipped_plants_lie_inside_the_bounds_where_a_fit_may_begin(plants):
    for parameter in PARAMETERS.values():
        assert parameter.lowest <= value_in(plants["fitted"], parameter.name) <= parameter.highest


def test_a_joint_keeps_what_it_holds_beyond_its_dry_friction(plants):
    plant = changed(plants["identified"], chosen_parameters(["coulomb_2"]), [1.0])
    assert plant.coulomb == (0.0, 1.0, 0.0)
    assert plant.breakaway == (0.5, 1.5, 0.5)


def test_coulomb_beside_one_joints_own_is_that_of_the_two_others(plants):
    plant = changed(plants["fitted"], chosen_parameters(["coulomb_3", "coulomb"]), [1.0, 0.2])
    assert plant.coulomb == (1.0, 1.0, 0.2)


def test_shares_and_values_are_each_others_inverse():
    parameters = chosen_parameters(DEFAULT)
    values = [(2 * each.lowest + each.highest) / 3 for each in parameters]
    assert from_unit(parameters, to_unit(parameters, values)).tolist() == pytest.approx(values)
    assert to_unit(parameters, [1e9] * 5).tolist() == [1.0] * 5


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        ([], "0 parameters cannot be fitted"),
        (["coulomb", "breakaway", "actuator_inertia", "active_viscous", "torque_limit", "current_lag"], "1 to 5 of"),
        (["colomb"], "'colomb' is not a parameter of a plant; did you mean coulomb"),
        (["torque_limit", "torque_limit"], "named twice"),
        (["coulomb", "coulomb_1", "coulomb_2", "coulomb_3"], "leave it out"),
    ],
)
def test_a_choice_that_cannot_be_fitted_is_refused(names, sentence):
    with pytest.raises(ConfigurationError, match=sentence):
        chosen_parameters(names)
