"""Codes of a message and of the messages in its fields."""

from photogram.words import Phrase


def codes(message):
    """Return the codes of a phrase, or of the phrase of a remark, finding or error, outermost first."""
    if not isinstance(message, Phrase | list | tuple):
        message = getattr(message, "phrase", None)
    if isinstance(message, Phrase):
        return [message.code, *(code for field in message.fields.values() for code in codes(field))]
    return [code for part in message or () for code in codes(part)]
