"""ContractOptions: what is refused, and what follows from the numbers."""
import numpy as np
import pytest
from missions import SWAP, robot

from mobile_planning import InvalidInput, UnicycleKineModel
from mobile_planning.fleet.contract_options import ContractOptions


@pytest.mark.parametrize('options', [
    {'rho': 0.0}, {'rho': -0.2}, {'rho': np.nan}, {'rho': 101.0}, {'margin': -0.01}, {'margin': np.nan}, {'Tc': 0.0},
    {'Tc': np.nan}, {'Tc': 11.0, 'Tp': 50.0}, {'Tp': 0.5}, {'Tp': 12.6}, {'Tp': np.nan}, {'Tp': np.inf},
    {'budget': -0.1}, {'budget': np.nan}, {'budget': 3.0}, {'sensor_range': 0.0}, {'sensor_range': np.nan}])
def test_a_parameter_out_of_its_range_is_refused_by_the_options_and_by_the_robot(options):
    for make in (ContractOptions, lambda **given: robot(1, *SWAP[0], **given)):
        with pytest.raises(InvalidInput, match='out of range'):
            make(**options)


def test_a_misspelt_option_is_refused():
    with pytest.raises(TypeError, match='raidus'):
        robot(1, *SWAP[0], raidus=0.3)


@pytest.mark.parametrize('v_max, Tp', [(1.0, 3.0), (2.0, 3.0), (1.0, 6.0)])
def test_a_robot_must_see_farther_than_two_of_its_kind_drive_until_they_rest(v_max, Tp):
    model = UnicycleKineModel(*SWAP[0], u_max=(v_max, 5.0))
    # Tp, what a plan may be longer by to come to rest, and the bodies.
    least = 2 * (v_max * (Tp + 3 * 0.125) + 0.205)
    with pytest.raises(InvalidInput, match=f'is below {least:.3f} m'):
        ContractOptions(Tp=Tp, sensor_range=least - 0.01).limits(model)
    assert ContractOptions(Tp=Tp, sensor_range=least + 0.01).limits(model).radius == pytest.approx(0.205)


def test_without_a_cycle_it_is_a_quarter_of_a_second():
    assert ContractOptions(Tc=None) == ContractOptions(Tc=0.25) == ContractOptions()
