from .adjust import plan_in_parts as plan_in_parts
from .division import Division as Division
from .plan import PartsPlan as PartsPlan
