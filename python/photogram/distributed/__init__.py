"""Adjustment in parts (Helmert blocking): on a Dask cluster, or one part after the other."""
