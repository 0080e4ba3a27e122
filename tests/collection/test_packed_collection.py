"""Collections that grow beyond what their first line announces are refused piece by piece, packed or not."""

from __future__ import annotations

import bz2
import gzip
from functools import partial

import pytest

from peak import peak_of
from photogram import InputError
from photogram.collection import read

HEAD = b"21 11315 36455\n"
NUMBERS = 3 + 4 * 36455 + 9 * 21 + 3 * 11315


def rejection(path):
    with pytest.raises(InputError) as error:
        read(path)
    return error.value


@pytest.mark.parametrize("pack", [bytes, bz2.compress, gzip.compress], ids=["plain", "bzip2", "gzip"])
@pytest.mark.parametrize(
    ("filling", "code"),
    [(b"0 ", "collection.beyond"), (b"  ", "collection.too-long"), (b"00", "file.long-number")],
)
def test_a_file_longer_than_its_first_line_says(tmp_path, pack, filling, code):
    path = tmp_path / "problem"
    path.write_bytes(pack(HEAD + filling * 6_000_000))
    error, peak = peak_of(partial(rejection, path))
    assert error.code == code
    fields = error.phrase.fields
    if code == "file.long-number":
        assert int(fields["length"]) > 1000
    else:
        assert str(fields["content"]).startswith(f"{NUMBERS} numbers")
    # The text has twelve million characters.
    assert peak < 8_000_000


def test_a_first_line_that_announces_too_much(tmp_path):
    path = tmp_path / "problem"
    path.write_bytes(b"21 11315 99999999999999\n0 0 1.0 2.0\n")
    with pytest.raises(InputError, match="must contain 400000000034133 numbers"):
        read(path)


def test_a_line_in_a_later_piece_is_named(tmp_path):
    rows = [b"%d 0 1.0 2.0" % (row % 2) for row in range(200_000)]
    rows[150_000] = b"0 0 1.0 x"
    path = tmp_path / "problem.gz"
    path.write_bytes(gzip.compress(b"2 1 200000\n" + b"\n".join(rows)))
    with pytest.raises(InputError) as raised:
        read(path)
    assert (raised.value.record, raised.value.text) == (150_002, "0 0 1.0 x")
