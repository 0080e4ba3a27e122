from .adjustment import AsPublished as AsPublished
from .adjustment import Ordering as Ordering
from .adjustment import Progress as Progress
from .adjustment import UnitVariance as UnitVariance
from .adjustment import adjust as adjust
