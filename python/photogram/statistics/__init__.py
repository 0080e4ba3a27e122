"""Statistics of an adjustment: tests, reliability, outliers."""

from photogram.statistics.limits import (
    NOTABLE_FACTOR,
    GlobalTest,
    externally_studentized,
    global_test,
    normal_limit,
    studentized_limit,
)

__all__ = [
    "NOTABLE_FACTOR",
    "GlobalTest",
    "externally_studentized",
    "global_test",
    "normal_limit",
    "studentized_limit",
]
