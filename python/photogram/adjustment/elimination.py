"""Backward elimination: terms of lenses that the observations do not ask for are left out, one by one."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.adjustment.adjustment import UnitVariance, adjust
from photogram.arguments.annotations import check_arguments
from photogram.arguments.arrays import probability
from photogram.arguments.objects import kind_error
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.results.cameras import AdjustedCamera
from photogram.results.model_tests import EFFECT, KEPT, TermsTest, groups_of_terms, terms_test
from photogram.results.result import Result
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Elimination:
    """What backward elimination has left of a model.

    Attributes
    ----------
    removed
        Tests of the groups that were left out, in order.
    kept
        Tests of those that stay.
    level
        Of each test: that of all divided by the number of groups (Bonferroni).
    block, result
        The block with the terms that stay, and its adjustment.
    """

    removed: tuple[TermsTest, ...]
    kept: tuple[TermsTest, ...]
    level: float
    block: Block
    result: Result

    def log(self) -> list[str]:
        """Return removed terms with the reason, then the remaining terms."""
        codes = ["improbable" if not each.probability < self.level else "small" for each in self.removed]
        rows = [*zip(codes, self.removed, strict=True), *(("kept", each) for each in self.kept)]
        return [
            str(
                phrase(
                    f"elimination.{code}",
                    names=each.names,
                    camera=each.camera,
                    probability=each.probability,
                    level=self.level,
                    effect=each.effect,
                )
            )
            for code, each in rows
        ]


def eliminate_terms(
    block: Block,
    *,
    groups: Sequence[Sequence[str]] | None = None,
    level: float = KEPT,
    unit_variance: UnitVariance = "constrained",
    threads: int | None = None,
) -> Elimination:
    """Leave out terms of lenses that are not worth having, the least probable group first.

    A group stays when it is significant and moves an image by more than a fifth of its standard deviation. A
    radial term is only asked about when those of higher powers are out. Every round adjusts anew.

    Parameters
    ----------
    block
        A block with cameras; free or weighted terms of their lenses are asked about.
    groups
        Terms that stay or go together; None: radial ones one by one, all others by their letter.
    level
        Of all tests together.
    unit_variance, threads
        As of :func:`photogram.adjust`.

    Raises
    ------
    InputError
        No cameras, or no terms to ask about.
    AdjustmentError, RankError
        As of the adjustment.
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
    """Whether a radial term has one of a higher power above it."""
    name = test.names[0]
    if len(test.names) > 1 or name[0] not in "Kk":
        return False
    others = [each for each in tests if each.camera == test.camera and len(each.names) == 1]
    return any(each.names[0][0] == name[0] and each.names[0] > name for each in others)


def _without(block: Block, test: TermsTest) -> Block:
    """Return the block with terms held at zero."""
    place = block.camera_names.index(test.camera)
    camera = block.cameras[place]
    if camera.covariance is not None and set(camera.covariance[0]) & set(test.names):
        raise InputError(phrase("elimination.covariance", names=test.names, camera=test.camera))
    zero = dict.fromkeys(test.names, 0.0)
    sd = camera.sd if isinstance(camera.sd, dict) else dict(zip(camera.names, camera.deviations, strict=True))
    changed = camera.replace(parameters={**camera.parameters, **zero}, sd={**sd, **zero})
    cameras = [changed if k == place else each for k, each in enumerate(block.cameras)]
    return block.replace(cameras=cameras)


check_arguments(globals(), ["eliminate_terms"])
