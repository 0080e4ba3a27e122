"""Sections of text: a title with lines."""

Section = tuple[str, list[str]]
