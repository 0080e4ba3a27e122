"""Partitioned adjustment (Helmert blocking): on a Dask cluster, or one part after the other."""

from photogram.distributed.adjust import plan_in_parts
from photogram.distributed.division import Division
from photogram.distributed.plan import PartsPlan

__all__ = ["Division", "PartsPlan", "plan_in_parts"]
