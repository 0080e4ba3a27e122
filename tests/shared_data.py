"""Where data stand that are not in the repository: tests that need them are skipped where they are absent."""

from pathlib import Path

SHARED = Path(__file__).parents[2] / "shared" / "data"
