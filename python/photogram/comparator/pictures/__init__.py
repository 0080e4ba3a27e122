"""Pictures of a calibration, made with matplotlib (`pip install 'photogram[plots]'`)."""

from photogram.comparator.pictures.book import figures, html_report, pdf_report

__all__ = ["figures", "html_report", "pdf_report"]
