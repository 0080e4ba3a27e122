"""Film and plates: certificates of their cameras, what years make of these, interior orientations."""

from photogram.arguments.on_demand import attach_checked

WAYS = {
    "document_of": {"Certificate": ("certificate_report",), "StepsCompared": ("steps",)},
    "findings_of": {"Certificate": ("certificate_findings",)},
    "page_of": {"Certificate": ("certificate_report",), "StepsCompared": ("steps",)},
    "report_of": {"Certificate": ("certificate_report",), "StepsCompared": ("steps",)},
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__, __all__ = attach_checked(__name__, __file__)
