"""Statistics of an adjustment: tests, critical values, reliability, degrees of freedom, radii of errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
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
    from photogram.statistics.error_radii import (
        circular_error,
        linear_error,
        mixture_circular,
        mixture_linear,
        sample_radius,
        spherical_error,
        upper_order,
    )
    from photogram.statistics.freedom import (
        coverage_factor,
        effective_freedom,
        joint_freedom,
        rmse_interval,
        welch_satterthwaite,
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
    from photogram.statistics.reliability import (
        largest_effect,
        minimal_detectable_error,
        noncentrality,
        standardized,
    )

__all__ = [
    "NOTABLE_FACTOR",
    "GlobalTest",
    "GroupTests",
    "b_method",
    "benjamini_hochberg",
    "bonferroni",
    "circular_error",
    "coverage_factor",
    "critical_chi_square",
    "critical_fisher",
    "critical_normal",
    "critical_student",
    "critical_tau",
    "effective_freedom",
    "externally_studentized",
    "global_test",
    "group_tests",
    "joint_freedom",
    "lambda0",
    "largest_effect",
    "linear_error",
    "log_chi_square",
    "log_fisher",
    "minimal_detectable_error",
    "mixture_circular",
    "mixture_linear",
    "noncentrality",
    "normal_limit",
    "parts_tests",
    "rmse_interval",
    "sample_radius",
    "spherical_error",
    "standardized",
    "studentized_limit",
    "upper_order",
    "welch_satterthwaite",
]

_HOMES = {
    "b_method": "distributions",
    "benjamini_hochberg": "distributions",
    "bonferroni": "distributions",
    "circular_error": "error_radii",
    "coverage_factor": "freedom",
    "critical_chi_square": "distributions",
    "critical_fisher": "distributions",
    "critical_normal": "distributions",
    "critical_student": "distributions",
    "critical_tau": "distributions",
    "effective_freedom": "freedom",
    "externally_studentized": "limits",
    "global_test": "limits",
    "GlobalTest": "limits",
    "group_tests": "groups",
    "GroupTests": "groups",
    "joint_freedom": "freedom",
    "lambda0": "distributions",
    "largest_effect": "reliability",
    "linear_error": "error_radii",
    "log_chi_square": "distributions",
    "log_fisher": "distributions",
    "minimal_detectable_error": "reliability",
    "mixture_circular": "error_radii",
    "mixture_linear": "error_radii",
    "noncentrality": "reliability",
    "normal_limit": "limits",
    "NOTABLE_FACTOR": "limits",
    "parts_tests": "groups",
    "rmse_interval": "freedom",
    "sample_radius": "error_radii",
    "spherical_error": "error_radii",
    "standardized": "reliability",
    "studentized_limit": "limits",
    "upper_order": "error_radii",
    "welch_satterthwaite": "freedom",
}
"""The module of each name, loaded when it is first asked for."""

__getattr__, __dir__ = on_demand(__name__, _HOMES)
