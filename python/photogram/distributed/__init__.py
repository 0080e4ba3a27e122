"""Adjustment in parts (Helmert blocking): on a Dask cluster, or one part after the other."""

from photogram.distributed.adjust import adjust_in_parts, plan_in_parts
from photogram.distributed.division import Division
from photogram.distributed.plan import PartsPlan

__all__ = ["Division", "PartsPlan", "adjust_in_parts", "plan_in_parts"]
