"""Statistics of an adjustment: tests, critical values, reliability, outliers."""

from photogram.statistics.distributions import (
    b_method,
    benjamini_hochberg,
    bonferroni,
    critical_chi_square,
    critical_fisher,
    critical_normal,
    critical_student,
    critical_tau,
    lambda0,
    log_chi_square,
    log_fisher,
)
from photogram.statistics.groups import GroupTests, group_tests, parts_tests
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
    "GroupTests",
    "b_method",
    "benjamini_hochberg",
    "bonferroni",
    "critical_chi_square",
    "critical_fisher",
    "critical_normal",
    "critical_student",
    "critical_tau",
    "externally_studentized",
    "global_test",
    "group_tests",
    "lambda0",
    "log_chi_square",
    "log_fisher",
    "normal_limit",
    "parts_tests",
    "studentized_limit",
]
