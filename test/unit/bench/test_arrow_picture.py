# SPDX-License-Identifier: BSD-3-Clause
"""Arrow tips are found in an image at the distance from the ball at which they were drawn."""
import numpy as np
import pytest
from arrow_picture import LOCKED, UNLOCKED, distances, tips_from_ball


def picture(shift=(0, 0)):
    """Return a ball at (60, 40), an arrow to the right of it, shifted, and one to the left."""
    image = np.full((80, 140, 3), 48, np.uint8)
    image[28:53, 48:73] = (200, 10, 200)
    x, y = shift
    image[38 + y:43 + y, 73:111 + x] = (210, 20, 15)
    image[38:43, 20:48] = (15, 20, 210)
    return image


def test_tips_are_found():
    tips = tips_from_ball(picture())
    np.testing.assert_allclose(tips[LOCKED], [50, 0])
    np.testing.assert_allclose(tips[UNLOCKED], [-40, 0])


def test_an_arrow_that_is_elsewhere_is_noticed():
    standing = tips_from_ball(picture())[LOCKED]
    shifted = tips_from_ball(picture((6, 8)))[LOCKED]
    assert distances(np.array([shifted]), standing) == pytest.approx((10.0, 10.0, 10.0))


def test_what_is_not_there_is_named():
    empty = np.full((80, 140, 3), 48, np.uint8)
    with pytest.raises(ValueError, match='ball: only 0 pixels'):
        tips_from_ball(empty)
