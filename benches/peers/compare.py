"""Simulated blocks adjusted by photogram and solved by its peers; prints one page of Markdown.

python benches/peers/compare.py 20x50 50x100 --work /tmp/peers --write docs/performance.md
"""

from __future__ import annotations

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import page
from needs import left_out
from remarks import REASONS
from runs import HERE, Plan, Runs, Size

SIZES = ("20x50", "50x100", "200x250", "1x1000", "1x5000", "1x50000")
SIDES = ("photogram", "photogram:1", "gtsam", "pycolmap", "symforce", "apex-solver")
BEGIN, END = "<!-- benchmark -->", "<!-- end of benchmark -->"


def main() -> int:
    """Run the comparison; the exit status is 1 when solutions differ."""
    arguments = _arguments()
    absent = left_out(arguments.sides)
    for line in absent.values():
        print(line, file=sys.stderr)
    plan = Plan(
        work=arguments.work,
        seed=arguments.seed,
        sides=[side for side in arguments.sides if side not in absent],
        peers_up_to=arguments.peers_up_to,
        repetitions=arguments.repetitions,
        limit=arguments.limit,
        marginals=arguments.marginals,
    )
    if arguments.fresh:
        for size in arguments.sizes:
            shutil.rmtree(Runs(plan, size).directory, ignore_errors=True)
    small = subprocess.run([sys.executable, HERE / "machine.py", "small"], check=True, capture_output=True)
    results = [Runs(plan, size).measured() for size in arguments.sizes]

    about = (HERE / "performance.md").read_text() + "".join(f"\n{line}\n" for line in absent.values())
    text = page.page(results, json.loads(small.stdout), _command(), about, REASONS)
    print(text)
    if arguments.write:
        arguments.write.write_text(text)
    if arguments.readme:
        _replace(arguments.readme, page.comparison(results[:1], columns=5))
    if all(agreement for measured in results for agreement in measured.agreements.values()):
        return 0
    print("The solutions do NOT agree: the times above mean nothing.", file=sys.stderr)
    return 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="photogram and its peers on simulated blocks")
    parser.add_argument(
        "sizes",
        nargs="*",
        type=Size.parse,
        default=[Size.parse(size) for size in SIZES],
        metavar="STRIPSxPHOTOS",
        help=f"blocks (default: {' '.join(SIZES)})",
    )
    temporary = Path(tempfile.gettempdir()) / "photogram-peers"
    parser.add_argument(
        "--work",
        type=Path,
        default=temporary,
        help="directory of results; what is there is not run again (default %(default)s)",
    )
    parser.add_argument("--fresh", action="store_true", help="run all again")
    parser.add_argument("--write", type=Path, help="write the page to this file too")
    parser.add_argument("--readme", type=Path, help="put the table of the first block into this file")
    parser.add_argument("--seed", type=int, default=1, help="of the simulated blocks (default %(default)s)")
    parser.add_argument(
        "--sides",
        nargs="+",
        default=list(SIDES),
        help=f"photogram first; side.py says more (default: {' '.join(SIDES)})",
    )
    parser.add_argument(
        "--peers-up-to",
        type=int,
        default=5000,
        metavar="PHOTOS",
        help="the largest block that the peers are given (default %(default)s)",
    )
    parser.add_argument(
        "--repetitions",
        type=int,
        default=3,
        help="of sides that take less than five seconds (default %(default)s)",
    )
    parser.add_argument(
        "--limit", type=float, default=600.0, help="seconds that a side may take (default %(default)s)"
    )
    parser.add_argument(
        "--marginals",
        type=float,
        default=60.0,
        help="seconds after which gtsam's marginals are extrapolated; 0: no covariances of the peers "
        "(default %(default)s)",
    )
    arguments = parser.parse_args()
    if arguments.sides[0] != "photogram":
        parser.error("photogram is the side that all others are compared with")
    return arguments


def _command() -> str:
    """Return the command as it was given, but for where and when results are kept."""
    words = [word for word in sys.argv[1:] if word != "--fresh"]
    if "--work" in words:
        del words[words.index("--work") : words.index("--work") + 2]
    return shlex.join(["python", "benches/peers/compare.py", *words])


def _replace(path: Path, text: str) -> None:
    """Put a text between the marks of the benchmark in a file."""
    before, begin, rest = path.read_text().partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise SystemExit(f"{path} has no {BEGIN} ... {END}")
    path.write_text(f"{before}{BEGIN}\n{text}{END}{after}")


if __name__ == "__main__":
    sys.exit(main())
