"""A short run of the fuzzer, and that it sees what it is there to see."""

import json
import os
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from fuzz import case, run
from fuzz.account import add_to
from fuzz.case import ENDINGS, Fuzzer, Outcome
from fuzz.damage import damaged
from fuzz.page import write_section
from fuzz.programs import PROGRAMS
from fuzz.sound import SOUND
from photogram import AdjustmentError, InputError

ROOT = Path(__file__).parents[2]
INPUTS = 700


def test_damaged_inputs_end_in_good_order(tmp_path):
    command = [
        sys.executable,
        "-m",
        "tests.fuzz",
        "--inputs",
        str(INPUTS),
        "--seed",
        "1",
        "--logs",
        str(tmp_path),
    ]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    outcomes = [json.loads(line)[0] for line in (tmp_path / "0.log").read_text().splitlines()]
    assert len(outcomes) == INPUTS
    # Half of a million do, give or take 4 % of so few.
    assert sum(outcome.get("reached", False) for outcome in outcomes) > 0.46 * INPUTS
    assert {outcome["format"] for outcome in outcomes} == set(SOUND)
    assert {outcome["ending"] for outcome in outcomes} == set(ENDINGS) - {"failed"}


def test_sound_inputs_converge(tmp_path, monkeypatch):
    command = [sys.executable, "-c", SOUND_RUN, str(tmp_path / "case")]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr


SOUND_RUN = """
import sys
from pathlib import Path
from tests.fuzz import case
case.damaged = lambda rng, files: dict(files)
fuzzer = case.Fuzzer(0, Path(sys.argv[1]))
wanted, number = set(case.SOUND), 0
while wanted:
    kind, _ = case.kind_of(0, number)
    if kind in wanted:
        outcome = fuzzer.run(number)
        assert outcome.fault is None, outcome
        # Options are drawn by lot: not every method can start everywhere. A check may find something, and
        # what is refused may be meant so.
        if outcome.ending == "converged" or kind == "GIANT project, check":
            assert outcome.reached, outcome
            wanted.discard(kind)
    number += 1
    assert number < 5000, wanted
"""


def test_every_format_has_inputs():
    assert set(SOUND) == set(PROGRAMS)


def test_an_input_is_the_same_every_time(tmp_path):
    fuzzers = [Fuzzer(3, tmp_path / name) for name in "ab"]
    for number in range(0, 60, 7):
        if case.kind_of(3, number)[0] != "exposures":  # they take long to make
            one, other = (fuzzer.input_of(number)[:2] for fuzzer in fuzzers)
            assert one == other


def test_most_damages_change_something():
    files = {"points.csv": b"id,x,y\na,1.5,2\nb,3,4.25\nc,7,8.5\n"}
    changed = [damaged(Random(seed), files) != files for seed in range(300)]
    assert sum(changed) > 270


@pytest.mark.skipif(not hasattr(os, "fork"), reason="workers are forked")
def test_what_ends_a_worker_is_named_and_the_run_goes_on(tmp_path, monkeypatch):
    class Deadly(Fuzzer):
        def __init__(self, seed, place):
            self.place = place

        def prepare(self, number):
            pass

        def run(self, number):
            if number == 2:
                os.abort()
            while number == 4:
                pass
            return Outcome("GIANT project", "converged", True)

    monkeypatch.setattr(run, "Fuzzer", Deadly)
    monkeypatch.setattr(run, "CPU_SECONDS", 0.2)
    figures = run.fuzz(0, 6, logs=tmp_path)
    assert [(number, outcome.fault) for number, outcome in figures.faults] == [
        (2, "SIGABRT"),
        (4, "more than 0.2 s of processor time"),
    ]
    assert figures.inputs == 6
    assert run.fuzz(0, 6, logs=tmp_path).endings == figures.endings


def test_faults_are_seen(tmp_path, monkeypatch):
    """A program that fails in each of the ways that count."""

    def judged(program):
        monkeypatch.setitem(case.PROGRAMS, "simulate", (program, 1))
        monkeypatch.setattr(case, "kind_of", lambda seed, number: ("simulate", Random(number)))
        return fuzzer.run(0)

    def raises(place, rng, quiet):
        raise OverflowError("too large")

    def half(place, rng, quiet):
        (place / "result.json").write_text('{"half": ')
        return ["result.json"]

    def changes(place, rng, quiet):
        next((place / "in").iterdir()).write_text("changed")
        return []

    def leaves(place, rng, quiet):
        (place / "x.tmp").write_text("")
        return []

    fuzzer = Fuzzer.__new__(Fuzzer)
    fuzzer.seed, fuzzer.place, fuzzer.sound = 0, tmp_path / "case", {}
    fuzzer.watch = type("Watch", (), {"reached": True, "results": [], "begin": lambda self: None})()
    assert "OverflowError: too large" in judged(raises).fault
    assert "is no JSON" in judged(half).fault
    assert "was changed" in judged(changes).fault
    assert "left behind" in judged(leaves).fault
    assert "is missing" in judged(lambda place, rng, quiet: ["result.json"]).fault
    assert judged(lambda place, rng, quiet: []).fault is None


@pytest.mark.parametrize(
    ("format", "reached", "error", "lacks"),
    [
        ("GIANT project", False, InputError("wrong"), "a message without file or option: wrong"),
        ("GIANT project", False, InputError("wrong", file=Path("COMMON")), None),
        ("GIANT project", False, InputError("--crs: wrong"), None),
        ("GIANT project", False, AdjustmentError("wrong"), None),
        ("GIANT project", True, InputError("wrong"), None),
        ("simulate", False, InputError("wrong"), None),
        ("simulate", True, AdjustmentError(" "), "an error without a message"),
    ],
)
def test_a_message_names_what_is_wrong(tmp_path, format, reached, error, lacks):  # noqa: A002
    fuzzer = Fuzzer(0, tmp_path)
    fuzzer.watch = type("Watch", (), {"reached": reached})()
    assert fuzzer._silent(format, error) == lacks


def test_the_section_of_a_page_is_replaced(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("above\n<!-- fuzz -->\nold\n<!-- /fuzz -->\nbelow\n")
    write_section(page, "fuzz", ["new"])
    assert page.read_text() == "above\n<!-- fuzz -->\n\nnew\n\n<!-- /fuzz -->\nbelow\n"
    with pytest.raises(ValueError, match="no section"):
        write_section(page, "other", [])


def test_parts_of_a_run_add_up(tmp_path):
    whole = run.fuzz(14, 30)
    account = tmp_path / "account.json"
    for numbers in (range(10), range(20, 30), range(10, 20)):
        found, done = add_to(account, run.fuzz(14, len(numbers), first=numbers.start), numbers)
    assert done == [range(30)]
    assert (found.endings, found.reached, found.faults) == (whole.endings, whole.reached, whole.faults)
    with pytest.raises(ValueError, match="some of the inputs from 25 to 40 already"):
        add_to(account, run.fuzz(14, 15, first=25), range(25, 40))
