"""Available memory, and rejection of work that needs more."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from photogram.errors import OutOfMemoryError
from photogram.words import phrase

VERSION_1 = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
VERSION_2 = ("memory.max", "memory.current", "inactive_file")
GROUPS = (  # Control groups version 2, without and with version 1; then version 1
    ("", "sys/fs/cgroup", *VERSION_2),
    ("", "sys/fs/cgroup/unified", *VERSION_2),
    ("memory", "sys/fs/cgroup/memory", *VERSION_1),
)
"""Controller, root of its group tree, files with limit and usage, and key of the reclaimable memory."""
STACK = 160 << 20  # Bytes of addresses for the stack of a thread, its share of the heap and a reserve


def available_memory(root: Path = Path("/")) -> int | None:
    """Return the memory available to this process without swapping, bytes; None if unknown.

    The minimum of three values: the available memory reported by Linux, the unused memory of the control
    groups (containers), and the unused part of the limits (`ulimit -v`, `ulimit -d`).
    """
    threads = os.cpu_count() or 1
    own = addresses_of_a_thread(root)
    limits = [max(left - own * _fitting(left, threads, own), 0) for left in _limits(root)]
    parts = [*_machine(root), *_groups(root), *limits]
    return min(parts) if parts else None


def resident_memory(root: Path = Path("/")) -> int | None:
    """Return the resident memory of this process, bytes; None if unknown."""
    fields = _text(root / "proc/self/statm").split()
    return os.sysconf("SC_PAGE_SIZE") * int(fields[1]) if len(fields) > 1 else None


def give_back() -> None:
    """Return freed memory to the operating system, if the allocators support it."""
    from photogram import _photocore

    if "pyarrow" in sys.modules:
        sys.modules["pyarrow"].default_memory_pool().release_unused()
    _photocore.give_back()


def require(needed: float, what: str) -> None:
    """Raise an OutOfMemoryError if work needs more memory than is available."""
    available = available_memory()
    if available is not None and needed > available:
        raise OutOfMemoryError(
            phrase("memory.required", subject=what, needed=gibibytes(needed), free=gibibytes(available))
        )


@contextmanager
def turned(what: str) -> Iterator[None]:
    """Convert a failed allocation into an :class:`OutOfMemoryError` that names the work."""
    try:
        yield
    except OutOfMemoryError:
        raise
    except MemoryError as error:
        detail = f"; {error}" if str(error) else ""
        # The message catalogue may not fit into the remaining memory.
        text = f"{what} requires more memory than is free{detail}. Close other programs, or use fewer data"
        exhausted = OutOfMemoryError(text)
        exhausted.phrase = phrase("memory.exhausted", subject=what, error=str(error))
        raise exhausted from None


def gibibytes(number: float) -> str:
    """Return a number of bytes in GiB, as text with three digits."""
    return f"{number / 2**30:.3g}"


def _machine(root: Path) -> Iterator[int]:
    """Yield the available memory of the machine, as reported by Linux."""
    for line in _text(root / "proc/meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            yield 1024 * int(line.split()[1])


def _groups(root: Path) -> Iterator[int]:
    """Yield the unused memory of each control group of the process."""
    for limit, usage, stat, spare in _counters(root, _text(root / "proc/self/cgroup")):
        most = _text(limit).strip()
        if most.isdecimal() and (used := _text(usage).strip()).isdecimal():
            counts = dict(line.partition(" ")[::2] for line in _text(stat).splitlines())
            yield max(int(most) - int(used) + int(counts.get(spare, 0)), 0)


@cache
def _counters(root: Path, groups: str) -> tuple[tuple[Path, Path, Path, str], ...]:
    """Find the files that count the memory of groups; their paths do not change."""
    found = []
    for line in groups.splitlines():
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        for controller, tree, limit, usage, spare in GROUPS:
            if controller not in controllers.split(","):
                continue
            # In a container, the tree may begin at the group itself while its path starts at the host.
            group = root / tree / ("" if ".." in path else path.strip("/"))
            for place in (group, *group.parents):
                if (place / limit).exists():
                    found.append((place / limit, place / usage, place / "memory.stat", spare))
                if place == root / tree:
                    break
    return tuple(found)


def _limits(root: Path) -> Iterator[int]:
    """Yield the unused part of each limit of the process."""
    try:
        import resource
    except ImportError:
        # The module does not exist on this system.
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
    """Return the addresses that a thread of the core needs, bytes; 0 if the cache size is unknown.

    Buffers of matrix products have twice the size of the cache and are allocated first.
    """
    size = _text(root / "sys/devices/system/cpu/cpu0/cache/index3/size").strip()
    return 2048 * int(size[:-1]) + STACK if size.endswith("K") and size[:-1].isdecimal() else 0


def threads_that_fit(threads: int, root: Path = Path("/")) -> int:
    """Return how many threads, at least 1, fit into half of the address limit."""
    left = min(_limits(root), default=None)
    return threads if left is None else _fitting(left, threads, addresses_of_a_thread(root))


def _fitting(left: int, threads: int, own: int) -> int:
    """Return how many threads with `own` addresses each fit into half of `left`; at least 1."""
    return max(1, min(threads, (left - own) // 2 // own)) if own else threads


def _text(path: Path) -> str:
    """Read a system file; return an empty text if it is not readable."""
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""
