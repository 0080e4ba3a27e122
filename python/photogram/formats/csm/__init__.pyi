from .cubes import read_list as read_list
from .cubes import read_support as read_support
from .isd import Isd as Isd
from .photos import SupportedImage as SupportedImage
