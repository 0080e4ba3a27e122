"""COLMAP: models as text and binary files, with rigs and frames."""
