from .network import POINT_TYPES as POINT_TYPES
from .network import ControlNetwork as ControlNetwork
from .network import measures_of as measures_of
from .network import points_of as points_of
from .network import read_network as read_network
from .writing import binary_network as binary_network
from .writing import network_text as network_text

TITLE: str
