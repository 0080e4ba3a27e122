"""Positions of photos, and how good they are, from what files of photographs already carry."""
