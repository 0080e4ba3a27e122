"""Backward elimination of lens terms that the observations do not require, one group at a time."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.adjustment.adjustment import adjust
from photogram.adjustment.options import UnitVariance
from photogram.arguments.arrays import probability
from photogram.arguments.objects import kind_error
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.results.model_tests import EFFECT, KEPT, TermsTest, groups_of_terms, terms_test
from photogram.results.parts import AdjustedCamera
from photogram.results.result import Result
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Elimination:
    """Result of the backward elimination of lens terms.

    Attributes
    ----------
    removed
        Tests of the removed groups, in order.
    kept
        Tests of the remaining groups.
    level
        Significance level of each test: the total level divided by the number of groups (Bonferroni).
    block, result
        Block with the remaining terms, and its adjustment.
    """

    removed: tuple[TermsTest, ...]
    kept: tuple[TermsTest, ...]
    level: float
    block: Block
    result: Result

    def log(self) -> list[str]:
        """Return removed terms with reasons, then the remaining terms."""
        tests = [("small" if test.probability < self.level else "improbable", test) for test in self.removed]
        tests += [("kept", test) for test in self.kept]
        lines = []
        for code, test in tests:
            values = {"probability": test.probability, "effect": test.effect, "level": self.level}
            lines.append(phrase(f"elimination.{code}", names=test.names, camera=test.camera, **values))
        return [str(line) for line in lines]


def eliminate_terms(
    block: Block,
    *,
    groups: Sequence[Sequence[str]] | None = None,
    level: float = KEPT,
    unit_variance: UnitVariance = "constrained",
    threads: int | None = None,
) -> Elimination:
    """Remove unnecessary lens terms, the least significant group first.

    A group remains if it is significant and moves an image by more than a fifth of its standard deviation. A
    radial term is tested only after all terms of higher power are removed. The block is adjusted in every
    round.

    Parameters
    ----------
    block
        Block with cameras; free or weighted terms of their lenses are tested.
    groups
        Terms that are removed together. None: radial terms separately, others by their letter.
    level
        Significance level of all tests together.
    unit_variance, threads
        As in :func:`photogram.adjust`.

    Raises
    ------
    InputError
        If cameras or terms to test are missing.
    AdjustmentError, RankError
        As in the adjustment.
    """
    if not isinstance(block, Block) or not block.cameras:
        raise kind_error("block", "a Block with cameras", block)
    probability("level", level)
    result = adjust(block, unit_variance=unit_variance, threads=threads)
    first = [(camera.name, names) for camera in result.cameras for names in _groups(camera, groups)]
    if not first:
        raise InputError(phrase("elimination.no-terms"))
    own = level / len(first)
    removed: list[TermsTest] = []
    while True:
        tests = [
            terms_test(result, names, camera=camera.name)
            for camera in result.cameras
            for names in _groups(camera, groups)
        ]
        asked = [
            each
            for each in tests
            if not _waits(each, tests) and not (each.probability < own and each.effect > EFFECT)
        ]
        if not asked:
            return Elimination(tuple(removed), tuple(tests), own, block, result)
        worst = max(asked, key=lambda each: each.probability)
        removed.append(worst)
        block = _without(block, worst)
        result = adjust(block, unit_variance=unit_variance, threads=threads)


def _groups(camera: AdjustedCamera, given: Sequence[Sequence[str]] | None) -> list[tuple[str, ...]]:
    """Return the groups of terms of a camera that are still estimated."""
    estimated = {camera.names[k] for k in camera.estimated}
    groups = groups_of_terms(camera) if given is None else [tuple(names) for names in given]
    return [names for names in groups if names and set(names) <= estimated]


def _waits(test: TermsTest, tests: Sequence[TermsTest]) -> bool:
    """Return whether a radial term of higher power remains."""
    name = test.names[0]
    if len(test.names) > 1 or name[0] not in "Kk":
        return False
    others = [each for each in tests if each.camera == test.camera and len(each.names) == 1]
    return any(each.names[0][0] == name[0] and each.names[0] > name for each in others)


def _without(block: Block, test: TermsTest) -> Block:
    """Return the block with terms fixed at zero."""
    place = block.camera_names.index(test.camera)
    camera = block.cameras[place]
    if camera.covariance is not None and set(camera.covariance[0]) & set(test.names):
        raise InputError(phrase("elimination.covariance", names=test.names, camera=test.camera))
    zero = dict.fromkeys(test.names, 0.0)
    changed = camera.replace(parameters={**camera.parameters, **zero}, sd={**camera.sd, **zero})
    cameras = [changed if k == place else each for k, each in enumerate(block.cameras)]
    return block.replace(cameras=cameras)
