from .adjustment import Progress as Progress
from .adjustment import adjust as adjust
from .options import AsPublished as AsPublished
from .options import Ordering as Ordering
from .options import UnitVariance as UnitVariance
