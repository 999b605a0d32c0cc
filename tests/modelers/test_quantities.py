"""Named numbers of shapes, and what is refused of them."""

import numpy as np
import pytest

from moldline.errors import ParameterError
from moldline.modelers.quantities import Quantities, choices, station_count
from moldline.modelers.wing_layout import Tip


def test_numbers_stand_under_their_names_in_one_vector():
    own = Quantities({"span": 2.0, "chord": [3.0, 1.0], "origin": np.zeros(3)})
    np.testing.assert_array_equal(own.values, [2.0, 3.0, 1.0, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(own.rows["chord"], [1, 2])
    np.testing.assert_array_equal(own.parted(own.values * 2)["chord"], [6.0, 2.0])


def test_lists_and_arrays_count_alike():
    each = {"chord": np.linspace(3, 1, 4), "twist": 0.0}
    assert station_count(each, {"span": [1.0, 2.0, 3.0]}, "wing") == 4
    assert station_count({"chord": 1.0}, {"span": 1.0}, "wing") == 2
    with pytest.raises(ParameterError, match="a wing needs two or more stations"):
        station_count({"chord": [1.0]}, {"span": 1.0}, "wing")


def test_a_word_that_is_no_choice_is_refused():
    with pytest.raises(ParameterError, match="tip must be one of round, flat, closed; got 'sharp'"):
        choices(tip=("sharp", Tip))
