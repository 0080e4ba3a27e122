"""Pictures of a calibration, made with matplotlib (`pip install 'photogram[plots]'`)."""

from photogram.comparator.pictures.book import figures

__all__ = ["figures"]
