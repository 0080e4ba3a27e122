"""Ways to damage the files of a project, by seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

Files = dict[str, bytes | None]
Random = np.random.Generator
Damage = Callable[[Random, Files], None]

SPOILERS = ["nan", "NaN", "inf", "-Infinity", "1E30", "1E99", "-1E-30", "99999999.", "-9999999.", "0.000"]
SPOILERS += [
    "1.2.3",
    "--5",
    "1-",
    "5 5",
    "12A",
    "0x1F",
    "1,5",
    "****",
    "3610000.",
    "16100.",
    "61.",
    "60.",
    "",
]
SPOILERS += [".000000001", "999999999", "\u0661\u0662", "\u2212" + "1.5", "1_0", "+", ".", "1D5", "1E"]
FIELDS = {
    "COMMON": [(n, n) for n in range(1, 18)] + [(18, 19), (31, 40), (41, 50), (51, 60), (61, 70)],
    "CAMERAS": [(1, 8), (11, 20)],
    "IMAGES": [(1, 8), (11, 20), (21, 30), (31, 40), (41, 48)],
    "FRAMES": [(1, 8), (9, 20), (21, 32), (33, 44), (45, 54), (55, 64), (65, 74)],
    "GROUND": [(1, 8), (9, 20), (21, 32), (33, 44), (45, 54), (55, 64), (65, 74), (80, 80)],
}


def pick(rng: Random, files: Files, names: Iterable[str]) -> str:
    """Pick one of some files, where it can be one that holds something."""
    return str(rng.choice([name for name in names if files[name]] or list(names)))


def of_lines(change: Callable[[Random, list[bytes], int], None]) -> Damage:
    """Make a damage of something that happens to the lines of one file, at one of them."""

    def damage(rng: Random, files: Files) -> None:
        name = pick(rng, files, files)
        lines = (files[name] or b"").split(b"\n")
        change(rng, lines, int(rng.integers(len(lines))))
        files[name] = b"\n".join(lines)

    return damage


def of_field(texts: list[str], only: dict[str, list[tuple[int, int]]] = FIELDS) -> Damage:
    """Make a damage of a text that is put into one field, right-justified."""

    def damage(rng: Random, files: Files) -> None:
        name = pick(rng, files, only)
        first, last = only[name][rng.integers(len(only[name]))]
        lines = (files[name] or b"").decode("latin-1").split("\n")
        row = 1 if name == "COMMON" and len(lines) > 1 else int(rng.integers(len(lines)))
        text = str(rng.choice(texts))[: last - first + 1].rjust(last - first + 1)
        lines[row] = f"{lines[row]:{last}}"[: first - 1] + text + lines[row][last:]
        files[name] = "\n".join(lines).encode()

    return damage


def of_files(change: Callable[[Random, Files, str, bytes], None]) -> Damage:
    """Make a damage of something that happens to one whole file."""

    def damage(rng: Random, files: Files) -> None:
        name = pick(rng, files, files)
        change(rng, files, name, files[name] or b"")

    return damage


def put(lines: list[bytes], at: int, line: bytes) -> None:
    lines[at] = line


def insert(rng: Random, lines: list[bytes], at: int, piece: bytes) -> None:
    column = int(rng.integers(len(lines[at]) + 1))
    lines[at] = lines[at][:column] + piece + lines[at][column:]


def overwrite(rng: Random, lines: list[bytes], at: int, piece: bytes) -> None:
    column = int(rng.integers(max(1, len(lines[at]))))
    lines[at] = lines[at][:column] + piece + lines[at][column + 1 :]


def one_of(rng: Random, pieces: list[bytes]) -> bytes:
    return pieces[rng.integers(len(pieces))]


def swap_lines(rng: Random, lines: list[bytes], at: int) -> None:
    other = int(rng.integers(len(lines)))
    lines[at], lines[other] = lines[other], lines[at]


def swap_files(rng: Random, files: Files, name: str, content: bytes) -> None:
    other = str(rng.choice(sorted(files)))
    files[name], files[other] = files[other], content


def rename(rng: Random, lines: list[bytes], at: int) -> None:
    other = lines[rng.integers(len(lines))][:8]
    lines[at] = other.ljust(8) + lines[at][8:]


def every_field(rng: Random, files: Files) -> None:
    """Give one column of numbers the same value in all records of a file."""
    name = pick(rng, files, FIELDS)
    first, last = FIELDS[name][rng.integers(1, len(FIELDS[name]))]
    text = str(rng.choice(["0.000", ".000001", "99999999.", "1.0", "-1.0", "900000.", ""]))
    lines = (files[name] or b"").decode("latin-1").split("\n")
    for row, line in enumerate(lines):
        if line.strip() and not line.startswith("****"):
            lines[row] = (
                f"{line:{last}}"[: first - 1]
                + text.rjust(last - first + 1)[-(last - first + 1) :]
                + line[last:]
            )
    files[name] = "\n".join(lines).encode()


def shuffled_columns(rng: Random, files: Files, name: str, first: int, last: int) -> None:
    """Give the records of a file the numbers of other records of it."""
    lines = [line.ljust(last) for line in (files[name] or b"").split(b"\n") if line.strip()]
    rows = [row for row, line in enumerate(lines) if line[first:last].strip()]
    pieces = [lines[row][first:last] for row in rows]
    for row, other in zip(rows, rng.permutation(len(rows)).tolist(), strict=True):
        lines[row] = lines[row][:first] + pieces[other] + lines[row][last:]
    files[name] = b"\n".join(lines)


def few_points(rng: Random, files: Files) -> None:
    """Keep few point records of IMAGES, with headers and terminators."""
    lines, share = (files["IMAGES"] or b"").split(b"\n"), rng.uniform(0, 0.4)
    headers = [True, *(line.startswith(b"****") for line in lines[:-1])]
    files["IMAGES"] = b"\n".join(
        line
        for line, header in zip(lines, headers, strict=True)
        if header or line.startswith(b"****") or rng.random() < share
    )


def other_sign(rng: Random, files: Files) -> None:
    """Turn the sign of the principal distance."""
    files["CAMERAS"] = (files["CAMERAS"] or b"").replace(b"  -", b"   ")


def set_file(make: Callable[[Random, bytes], bytes | None]) -> Damage:
    return of_files(lambda rng, files, name, content: files.__setitem__(name, make(rng, content)))


def without_terminators(rng: Random, files: Files) -> None:
    lines = (files["IMAGES"] or b"").split(b"\n")
    share = rng.random()
    files["IMAGES"] = b"\n".join(
        line for line in lines if not line.startswith(b"****") or rng.random() < share
    )


DAMAGES: dict[str, Damage] = {
    "line deleted": of_lines(lambda rng, lines, at: lines.pop(at)),
    "line duplicated": of_lines(lambda rng, lines, at: lines.insert(at, lines[at])),
    "lines swapped": of_lines(swap_lines),
    "line truncated": of_lines(lambda rng, lines, at: put(lines, at, lines[at][: rng.integers(30)])),
    "line blanked": of_lines(lambda rng, lines, at: put(lines, at, b" " * int(rng.integers(90)))),
    "line of rubbish": of_lines(lambda rng, lines, at: lines.insert(at, rng.bytes(40).replace(b"\n", b""))),
    "line of text": of_lines(lambda rng, lines, at: lines.insert(at, b"THIS IS A COMMENT OF 1987")),
    "byte changed": of_lines(lambda rng, lines, at: overwrite(rng, lines, at, rng.bytes(1))),
    "letter": of_lines(
        lambda rng, lines, at: overwrite(rng, lines, at, one_of(rng, [b"O", b"l", b"E", b"e"]))
    ),
    "sign or point": of_lines(
        lambda rng, lines, at: overwrite(rng, lines, at, one_of(rng, [b"-", b".", b"+"]))
    ),
    "digit": of_lines(lambda rng, lines, at: overwrite(rng, lines, at, b"%d" % rng.integers(10))),
    "columns shifted right": of_lines(
        lambda rng, lines, at: insert(rng, lines, at, b" " * int(rng.integers(1, 9)))
    ),
    "columns shifted left": of_lines(
        lambda rng, lines, at: put(lines, at, lines[at][int(rng.integers(1, 9)) :])
    ),
    "control character": of_lines(
        lambda rng, lines, at: insert(
            rng, lines, at, one_of(rng, [b"\t", b"\0", b"\x1b", b"\x7f", b"\x0c", b"\x85"])
        )
    ),
    "not UTF-8": of_lines(
        lambda rng, lines, at: overwrite(rng, lines, at, one_of(rng, [b"\xff", b"\xe9", b"\xc3"]))
    ),
    "beyond ASCII": of_lines(
        lambda rng, lines, at: overwrite(
            rng, lines, at, one_of(rng, [b"\xc3\xa9", b"\xe2\x80\xa8", b"\xf0\x9f\x93\xb7"])
        )
    ),
    "name changed": of_lines(rename),
    "names in lower case": of_lines(lambda rng, lines, at: put(lines, at, lines[at].lower())),
    "terminator put": of_lines(lambda rng, lines, at: lines.insert(at, b"****")),
    "terminators lost": without_terminators,
    "field spoilt": of_field(SPOILERS),
    "switch spoilt": of_field([*"0123456789-x*"], {"COMMON": FIELDS["COMMON"]}),
    "extreme weight": of_field(
        [".000000001", "0.001", "99999999.", "1E30", "1E-30"],
        {name: FIELDS[name][4:7] for name in ("FRAMES", "GROUND")} | {"IMAGES": [(21, 30), (31, 40)]},
    ),
    "extreme value": of_field(
        ["0.000", "-99999999.", "99999999.", "1E9", ".0001", "3595959.9", "-900000."],
        {name: FIELDS[name][1:4] for name in ("FRAMES", "GROUND", "IMAGES")} | {"CAMERAS": [(11, 20)]},
    ),
    "a column all the same": every_field,
    "image coordinates mixed up": lambda rng, files: shuffled_columns(rng, files, "IMAGES", 10, 30),
    "names of points mixed up": lambda rng, files: shuffled_columns(rng, files, "IMAGES", 0, 8),
    "stations mixed up": lambda rng, files: shuffled_columns(rng, files, "FRAMES", 8, 44),
    "control mixed up": lambda rng, files: shuffled_columns(rng, files, "GROUND", 8, 44),
    "few points": few_points,
    "sign of the principal distance": other_sign,
    "file empty": set_file(lambda rng, content: b""),
    "file missing": set_file(lambda rng, content: None),
    "file cut short": set_file(lambda rng, content: content[: rng.integers(len(content) + 1)]),
    "file of rubbish": set_file(lambda rng, content: rng.bytes(int(rng.integers(400)))),
    "file twice": set_file(lambda rng, content: content * 2),
    "files swapped": of_files(swap_files),
    "CRLF": set_file(lambda rng, content: content.replace(b"\n", b"\r\n")),
    "CR": set_file(lambda rng, content: content.replace(b"\n", b"\r")),
    "no line ends": set_file(lambda rng, content: content.replace(b"\n", b"")),
    "UTF-16": set_file(lambda rng, content: content.decode("latin-1").encode("utf-16")),
    "byte order mark and end of file": set_file(lambda rng, content: b"\xef\xbb\xbf" + content + b"\x1a"),
}


def damaged(files: dict[str, bytes], seed: int) -> tuple[Files, list[str]]:
    """Return files with one or two damages, and the names of these."""
    rng = np.random.default_rng(seed)
    kinds = list(DAMAGES)
    # Every kind in turn, alone first and later with others.
    chosen = [kinds[seed % len(kinds)], *(str(rng.choice(kinds)) for _ in range(min(1, seed // 420)))]
    result: Files = dict(files)
    for kind in chosen:
        DAMAGES[kind](rng, result)
    return result, chosen
