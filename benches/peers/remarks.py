"""Why targets are missed and what was tried, by the names of the targets; printed for those that are."""

REASONS: dict[str, str] = {}
