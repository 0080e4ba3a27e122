from .isd import Isd as Isd
from .lists import read_list as read_list
from .lists import read_support as read_support
from .photos import SupportedImage as SupportedImage
