from .findings import Diagnosis as Diagnosis
from .findings import Finding as Finding
from .findings import Section as Section
