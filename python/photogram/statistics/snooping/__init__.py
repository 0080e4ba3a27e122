"""Iterative data snooping: detection and removal of gross errors."""
