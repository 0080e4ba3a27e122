"""A dataclass that waits is, to whoever uses it, the one that `dataclasses` makes at once."""

import dataclasses
import inspect
import pickle
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest

from photogram import Message, lazy_dataclasses


def is_made(kind):
    return type(vars(kind)["__init__"]).__name__ != "_Later"


def family(dataclass):
    """Return two classes as a decorator makes them, the second with what the first has."""

    @dataclass(frozen=True)
    class Point:
        """A point."""

        x: float
        y: float = 0.0
        names: list = dataclasses.field(default_factory=list, compare=False)

    @dataclass(frozen=True, eq=False, kw_only=True)
    class Named(Point):
        """With a name."""

        name: str

        def __post_init__(self):
            object.__setattr__(self, "name", self.name.upper())

        def __repr__(self):
            return self.name

    return Point, Named


STANDARD = family(dataclasses.dataclass)


def error_of(call):
    with pytest.raises((dataclasses.FrozenInstanceError, TypeError)) as caught:
        call()
    return type(caught.value), str(caught.value)


@pytest.mark.parametrize(
    "look",
    [
        lambda point, named: [(each.name, each.kw_only) for each in dataclasses.fields(named)],
        lambda point, named: str(inspect.signature(point)) + str(inspect.signature(named)),
        lambda point, named: repr(point(1.0, 2.0)).rpartition(".")[2] + repr(named(1.0, name="p")),
        lambda point, named: (point(1.0) == point(1.0), named(1.0, name="p") == named(1.0, name="p")),
        lambda point, named: (point(1.0) == point(2.0), len({point(1.0), point(1.0)})),
        lambda point, named: hash(point(1.0, 2.0)),
        lambda point, named: vars(dataclasses.replace(named(1.0, name="p"), y=3.0)),
        lambda point, named: dataclasses.asdict(named(1.0, name="p")),
        lambda point, named: (point.__match_args__, named.__match_args__, point.__doc__),
        lambda point, named: error_of(lambda: setattr(point(1.0), "x", 2.0)),
        lambda point, named: error_of(lambda: delattr(named(1.0, name="p"), "x")),
        lambda point, named: error_of(lambda: setattr(named(1.0, name="p"), "other", 2.0)),
        lambda point, named: error_of(lambda: dataclasses.dataclass(type("Thawed", (point,), {}))),
        lambda point, named: error_of(lambda: named(1.0)),
    ],
)
def test_it_is_what_the_standard_library_makes(look):
    assert look(*family(lazy_dataclasses.dataclass)) == look(*STANDARD)


def test_it_waits_until_it_is_used():
    point, named = family(lazy_dataclasses.dataclass)
    assert not is_made(point)
    assert not is_made(named)
    assert point(1.0).x == 1.0
    assert is_made(point)
    assert not is_made(named)


@pytest.mark.parametrize(
    ("use", "told"),
    [
        ("print(repr(found))", repr(Message("text"))),
        ("print(found == Message('text'), hash(found) == hash(Message('text')))", "True True"),
        ("print(hash(found) == hash(('text', None, None, None, None)))", "True"),
        (
            "try: found.text = 1\nexcept AttributeError as error: print(error)",
            "cannot assign to field 'text'",
        ),
    ],
)
def test_what_was_pickled_is_the_same_in_a_process_that_has_made_none(use, told):
    """Unpickling calls no `__init__`: whatever is asked of the object first has its class made."""
    program = f"import pickle\nfound = pickle.loads({pickle.dumps(Message('text'))!r})\n"
    program += f"from photogram.messages import Message\n{use}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == told


def test_threads_make_it_once():
    for _ in range(50):
        point, _ = family(lazy_dataclasses.dataclass)
        with ThreadPoolExecutor(4) as pool:
            assert {each.x for each in pool.map(partial(point), [1.0] * 16)} == {1.0}


def test_options_that_it_does_not_have_are_refused():
    with pytest.raises(TypeError, match="slots"):
        lazy_dataclasses.dataclass(slots=True)


@pytest.mark.parametrize("frozen", [True, False])
def test_threads_create_one_class_at_once(frozen):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for _ in range(100):

            @lazy_dataclasses.dataclass(frozen=frozen)
            class Shared:
                first: int
                second: list = lazy_dataclasses.field(default_factory=list)

                def __post_init__(self):
                    object.__setattr__(self, "third", self.first + 1)

            @lazy_dataclasses.dataclass(frozen=frozen)
            class Derived(Shared):
                fourth: int = 4

            ready, made, names = threading.Barrier(4), [], set()

            def create(kind=Derived, ready=ready, made=made, names=names):
                ready.wait()
                names.add(tuple(each.name for each in dataclasses.fields(kind)))
                made.append(kind(first=1))

            threads = [threading.Thread(target=create) for _ in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            assert names == {("first", "second", "fourth")}
            assert made == [Derived(1)] * 4
            assert [one.third for one in made] == [2] * 4
    finally:
        sys.setswitchinterval(interval)
