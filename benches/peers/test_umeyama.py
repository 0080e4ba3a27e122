"""The peers of absolute orientation find the similarity that photogram finds."""

import pytest
from compare_similarity import differ, photogram_solver, simulate, skimage_solver
from umeyama import umeyama


@pytest.mark.parametrize("count", [4, 50])
def test_the_closed_form(count: int) -> None:
    """Umeyama's closed form, with noise and a large tilt."""
    control, model = simulate(count, 3)
    assert differ(umeyama(control, model), photogram_solver(control, model)) < 1e-10


def test_scikit_image() -> None:
    """The same from scikit-image."""
    pytest.importorskip("skimage")
    control, model = simulate(20, 3)
    assert differ(skimage_solver(control, model), umeyama(control, model)) < 1e-10
