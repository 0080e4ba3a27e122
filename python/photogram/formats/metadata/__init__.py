"""Positions of photos and their accuracy from metadata of photograph files."""
