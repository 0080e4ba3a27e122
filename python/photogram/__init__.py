"""Photogrammetric least-squares adjustment with the covariance of every result."""

from photogram.block import Block
from photogram.errors import AdjustmentError, InputError, PhotogramError, RankError
from photogram.messages import Message

__all__ = ["AdjustmentError", "Block", "InputError", "Message", "PhotogramError", "RankError"]
