"""Pictures of a calibration, made with matplotlib (`pip install 'photogram[plots]'`)."""

from photogram.comparator.pictures.book import figures, pdf_report

__all__ = ["figures", "pdf_report"]
