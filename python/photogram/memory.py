"""How much memory there is, and the refusal of work that would take more."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from photogram.errors import OutOfMemoryError
from photogram.words import phrase

GROUPS = (
    # Version 2, alone and beside version 1; then version 1.
    ("", "sys/fs/cgroup", "memory.max", "memory.current", "inactive_file"),
    ("", "sys/fs/cgroup/unified", "memory.max", "memory.current", "inactive_file"),
    (
        "memory",
        "sys/fs/cgroup/memory",
        "memory.limit_in_bytes",
        "memory.usage_in_bytes",
        "total_inactive_file",
    ),
)
"""Controllers as `/proc/self/cgroup` names them, where the tree of their groups stands, the files with the
limit of a group and with what it uses, and what of that the kernel gives back when asked."""
STACK = 160 << 20  # Addresses for the stack of a thread, its share of the heap, and what is kept in reserve


def available_memory(root: Path = Path("/")) -> int | None:
    """Return the bytes that this process can still take without swapping; None where nothing tells.

    The least of what Linux says is available, of what the control group of the process (a container) and
    the groups around it may still take, and of what the limits of the process (`ulimit -v`, `ulimit -d`)
    leave.
    """
    threads = os.cpu_count() or 1
    own = addresses_of_a_thread(root)
    limits = [max(left - own * _fitting(left, threads, own), 0) for left in _limits(root)]
    parts = [*_machine(root), *_groups(root), *limits]
    return min(parts) if parts else None


def resident_memory(root: Path = Path("/")) -> int | None:
    """Return the bytes of memory that this process holds; None where nothing tells."""
    fields = _text(root / "proc/self/statm").split()
    return os.sysconf("SC_PAGE_SIZE") * int(fields[1]) if len(fields) > 1 else None


def give_back() -> None:
    """Have what was freed given back to the system, where the library that keeps it can be told to."""
    from photogram import _photocore

    if "pyarrow" in sys.modules:
        sys.modules["pyarrow"].default_memory_pool().release_unused()
    _photocore.give_back()


def require(needed: float, what: str) -> None:
    """Refuse work that would take more memory than there is, before it begins."""
    available = available_memory()
    if available is not None and needed > available:
        raise OutOfMemoryError(
            phrase("memory.required", subject=what, needed=gibibytes(needed), free=gibibytes(available))
        )


@contextmanager
def turned(what: str) -> Iterator[None]:
    """Turn an allocation that fails into an :class:`OutOfMemoryError`; `what` says for what it was."""
    try:
        yield
    except OutOfMemoryError:
        raise
    except MemoryError as error:
        detail = f"; {error}" if str(error) else ""
        # The files of words may not fit into the rest of the memory.
        exhausted = OutOfMemoryError(f"{what}: there is not enough memory{detail}")
        exhausted.phrase = phrase("memory.exhausted", subject=what, error=str(error))
        raise exhausted from None


def gibibytes(number: float) -> str:
    """Return a number of bytes in GiB, as text with three digits."""
    return f"{number / 2**30:.3g}"


def _machine(root: Path) -> Iterator[int]:
    """Yield what Linux says is available."""
    for line in _text(root / "proc/meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            yield 1024 * int(line.split()[1])


def _groups(root: Path) -> Iterator[int]:
    """Yield what the control groups of the process, and all around them, may still take."""
    for limit, usage, stat, spare in _counters(root, _text(root / "proc/self/cgroup")):
        most = _text(limit).strip()
        if most.isdecimal() and (used := _text(usage).strip()).isdecimal():
            counts = dict(line.partition(" ")[::2] for line in _text(stat).splitlines())
            yield max(int(most) - int(used) + int(counts.get(spare, 0)), 0)


@cache
def _counters(root: Path, groups: str) -> tuple[tuple[Path, Path, Path, str], ...]:
    """Find the files that count the memory of groups: limits may change, where they stand does not."""
    found = []
    for line in groups.splitlines():
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        for controller, tree, limit, usage, spare in GROUPS:
            if controller not in controllers.split(","):
                continue
            # In a container the tree may begin at the group itself, and its path be that of the host.
            group = root / tree / ("" if ".." in path else path.strip("/"))
            for place in (group, *group.parents):
                if (place / limit).exists():
                    found.append((place / limit, place / usage, place / "memory.stat", spare))
                if place == root / tree:
                    break
    return tuple(found)


def _limits(root: Path) -> Iterator[int]:
    """Yield what the limits of the process leave."""
    try:
        import resource
    except ImportError:
        # Not on this system.
        return
    limits = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    if all(soft == resource.RLIM_INFINITY for soft in limits):
        return
    fields = _text(root / "proc/self/statm").split()
    if len(fields) > 5:
        page = os.sysconf("SC_PAGE_SIZE")
        for soft, used in zip(limits, (fields[0], fields[5]), strict=True):
            if soft != resource.RLIM_INFINITY:
                yield soft - page * int(used)


@cache
def addresses_of_a_thread(root: Path = Path("/")) -> int:
    """Return the addresses that a thread of the core takes; 0 where the cache is not known.

    The products of matrices have buffers of twice the cache. The core takes them before it begins.
    """
    size = _text(root / "sys/devices/system/cpu/cpu0/cache/index3/size").strip()
    return 2048 * int(size[:-1]) + STACK if size.endswith("K") and size[:-1].isdecimal() else 0


def threads_that_fit(threads: int, root: Path = Path("/")) -> int:
    """Return how many of some threads half of what a limit of addresses leaves suffices for; one at least."""
    left = min(_limits(root), default=None)
    return threads if left is None else _fitting(left, threads, addresses_of_a_thread(root))


def _fitting(left: int, threads: int, own: int) -> int:
    """Return how many of some threads, each with `own` addresses, half of those left suffices for."""
    return max(1, min(threads, (left - own) // 2 // own)) if own else threads


def _text(path: Path) -> str:
    """Read what the system tells; empty where it does not."""
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""
