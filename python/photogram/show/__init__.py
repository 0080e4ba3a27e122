"""Elements of the reports and plots of all programs."""
