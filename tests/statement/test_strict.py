"""What only `--strict` does not let pass: exit code, headline and mark come from one judgement."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from golden_statement import BLOCK

from photogram.statistics.verdict import as_phrase


@pytest.fixture(scope="module")
def plain(result):
    return result.statement(budgets=(), standards=("plain",))


def judge(found, left_out, *, strict):
    """Judge a statement anew, with other control points left out."""
    return replace(found, left_out=left_out, layout=None, strict=strict).judged


def seen(found):
    return found.exit, found.tone


def test_a_control_point_that_disagrees_is_named_and_with_strict_ends_with_4(plain):
    third, limit = plain.left_out[2], 0.05 / len(plain.left_out)
    assert third.point == "G03"
    for p, is_wrong in ((1.01 * limit, False), (0.99 * limit, True)):
        left_out = [*plain.left_out[:2], replace(third, p=p), *plain.left_out[3:]]
        before, strictly = (judge(plain, left_out, strict=strict) for strict in (False, True))
        assert seen(before) == (0, "look")
        assert before.headline == "Accuracy as found with 30 check points"
        assert any("Control point G03 does not agree" in each for each in before.remarks) == is_wrong
        if is_wrong:
            assert seen(strictly) == (4, "bad")
            assert strictly.headline == "Control disagrees with the rest of the block: G03"
        else:
            assert strictly == before


def lengths_of(result, error):
    """Return fifteen lengths on seven lines, longer than measured by an error."""
    names = [f"C{k:02}" for k in range(1, 31)]
    places = {name: result.point_positions[result.block.point_ids.index(name)] for name in names}
    return [
        {
            "line": f"line {k % 7}",
            "from": first,
            "to": second,
            "length": float(np.linalg.norm(places[first] - places[second])) + error,
            "sd": 0.001,
        }
        for k, (first, second) in enumerate(zip(names[:15], names[15:], strict=True))
    ]


@pytest.mark.parametrize(("error", "key"), [(0.5, "lengths.high"), (0.0, "lengths.low")])
def test_lengths_that_disagree_with_what_is_predicted_are_looked_at_and_with_strict_end_with_4(
    result, error, key
):
    asked = {"standards": ("vdi-2634",), "lengths": lengths_of(result, error), "budgets": ()}
    found, strictly = (result.statement(**asked, strict=strict) for strict in (False, True))
    assert key in {each["key"] for each in found.sentences}
    assert seen(found.judged) == (0, "look")
    assert "Stated, with remarks" in found.to_html().decode()
    assert seen(strictly.judged) == (4, "bad")
    assert strictly.headline == "Calibrated lengths disagree with their predicted standard deviations"
    assert "Not to be handed over as it is" in strictly.to_html().decode()


def test_lengths_alone_take_the_green_mark_away(result):
    """Nothing else is to be looked at: check points agree, lengths are as many and as warm as asked for."""
    lengths = [{**each, "temperature": 20.0} for each in lengths_of(result, 0.5)]
    asked = {"standards": ("vdi-2634",), "lengths": lengths, "expansion": 1e-5, "budgets": ()}
    found = result.statement(**asked)
    assert "lengths.reference" in {each["key"] for each in found.assumptions}
    points = replace(found.of_all.points, p=np.ones(30), p_others=np.ones(30))
    agreed = replace(found.of_all, points=points)
    found = replace(found, of_all=agreed, of_vegetated=None, layout=None)
    enough = replace(found.standards.lengths, names="1234567" * 5, longest=1.0, off_diagonal=0.0)
    for lengths, tone in ((enough, "look"), (replace(enough, together=None), "good")):
        changed = replace(found, standards=replace(found.standards, lengths=lengths))
        assert changed.judged.tone == tone


def test_a_warning_of_the_adjustment_is_no_result_that_cannot_be_used(plain, monkeypatch):
    verdict = plain.result.verdict
    monkeypatch.setitem(vars(plain.result), "verdict", replace(verdict, warning=True))
    before, strictly = (judge(plain, plain.left_out, strict=strict) for strict in (False, True))
    assert seen(before) == (0, "look")
    assert seen(strictly) == (4, "bad")
    assert strictly.headline.startswith("The verdict of the adjustment is a warning: Accepted")


@pytest.mark.parametrize("code", [3, 4])
def test_a_verdict_that_forbids_the_use_forbids_the_statement(plain, monkeypatch, code):
    verdict = plain.result.verdict
    monkeypatch.setitem(
        vars(plain.result), "verdict", replace(verdict, exit=code, message=as_phrase("Undetermined"))
    )
    found = judge(plain, plain.left_out, strict=False)
    assert seen(found) == (4, "bad")
    assert found.headline == "The adjustment cannot be used as it is: Undetermined"


def test_the_command_ends_with_what_the_page_says(run, tmp_path, monkeypatch):
    """Lengths of a project that are all half a metre too long."""
    monkeypatch.chdir(tmp_path)
    site = Path("site")
    site.mkdir()
    for path in BLOCK.iterdir():
        (site / path.name).write_bytes(path.read_bytes())
    rows = ["line,from,to,length,sd", "a,C01,C30,238.0,0.001", "b,C05,C26,240.0,0.001"]
    (site / "lengths.csv").write_text("\n".join(rows) + "\n")
    ends = [
        run("statement", site, "--standard", "vdi-2634", "--out", "out", *strict)
        for strict in ((), ("--strict",))
    ]
    assert [each.exit_code for each in ends] == [0, 4], ends[0].output
    document = json.loads(Path("out/statement.json").read_text())
    assert document["exit"] == 4
    assert document["headline"].startswith("Calibrated lengths disagree")
    assert document["headline"] in ends[1].output
