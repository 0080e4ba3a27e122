"""Validation and conversion of arguments of public functions."""
