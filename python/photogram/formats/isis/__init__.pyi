from .network import POINT_TYPES as POINT_TYPES
from .network import ControlMeasures as ControlMeasures
from .network import ControlNetwork as ControlNetwork
from .network import ControlPoints as ControlPoints
from .network import read_network as read_network
from .writing import binary_network as binary_network
from .writing import network_text as network_text
