"""Damage to files: bytes changed, cut out, put twice, lines lost, numbers spoilt."""

from __future__ import annotations

import shutil

import numpy as np

from photogram import InputError, formats

WORDS = (b"nan", b"1e400", b"-", b"x", b"", b"-5", b"99999999999999999999", b'"', b"\xff", b"0", b"inf")


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    """Return content with one to three faults."""
    data = bytearray(content)
    for _ in range(int(random.integers(1, 4))):
        if not data:
            break
        start = int(random.integers(len(data)))
        length = int(min(len(data) - start, random.choice([1, 1, 4, 8, 30, 200])))
        kind = int(random.integers(7))
        if kind == 0:
            data[start : start + length] = random.integers(0, 256, length, dtype=np.uint8).tobytes()
        elif kind == 1:
            del data[start : start + length]
        elif kind == 2:
            data[start:start] = data[start : start + length]
        elif kind == 3:
            del data[start:]
        elif kind == 4:
            data[start : start + length] = WORDS[int(random.integers(len(WORDS)))]
        elif kind == 5:
            lines = bytes(data).split(b"\n")
            del lines[int(random.integers(len(lines)))]
            data = bytearray(b"\n".join(lines))
        else:
            words = bytes(data).split(b",") if b"," in data else bytes(data).split(b" ")
            words[int(random.integers(len(words)))] = WORDS[int(random.integers(len(WORDS)))]
            data = bytearray((b"," if b"," in data else b" ").join(words))
    return bytes(data)


def check_damaged(source, place, file_format, times, seed, options=None):
    """Read damaged copies of a folder or file: each is read, or refused with a place."""
    random = np.random.default_rng(seed)
    refused = 0
    for number in range(times):
        copy = place / "copy"
        if source.is_dir():
            shutil.rmtree(copy, ignore_errors=True)
            copy.mkdir(parents=True)
            for each in source.iterdir():
                shutil.copyfile(each, copy / each.name)
            files = sorted(copy.iterdir())
        else:
            copy = place / source.name
            shutil.copyfile(source, copy)
            files = [copy]
        victim = files[int(random.integers(len(files)))]
        victim.write_bytes(damaged(victim.read_bytes(), random))
        error = refusal(copy, file_format, options)
        if error is not None:
            refused += 1
            assert error.file is not None, f"{number}: {error}"
            assert error.__cause__ is None, f"{number}: {error!r} for {error.__cause__!r}"
    return refused


def refusal(path, file_format, options):
    """Return why a path is refused; None where it is read."""
    try:
        formats.read(path, options, file_format=file_format)
    except InputError as error:
        return error
    return None
