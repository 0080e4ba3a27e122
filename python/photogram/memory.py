"""How much memory there is."""

from __future__ import annotations

from pathlib import Path

__all__ = ["available_memory"]

_MEMINFO = Path("/proc/meminfo")
_GROUP = Path("/sys/fs/cgroup")


def available_memory(meminfo: Path = _MEMINFO, group: Path = _GROUP) -> int | None:
    """Return the bytes that a program can still take without swapping; None where the system does not tell.

    What Linux says is available, and no more than the control group of the process (a container) may still
    take.
    """
    try:
        lines = meminfo.read_text().splitlines()
        kibibytes = next(line.split()[1] for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration):
        return None
    available = 1024 * int(kibibytes)
    try:
        limit = int((group / "memory.max").read_text())
        return min(available, max(limit - int((group / "memory.current").read_text()), 0))
    except (OSError, ValueError):
        # No such group, or one without limit.
        return available
