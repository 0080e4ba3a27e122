"""Codes of messages, and of the messages in their fields."""

from photogram.words import Phrase


def codes(message):
    """Return the codes of an error or phrase, the outermost first."""
    phrase = message if isinstance(message, Phrase) else message.phrase
    if phrase is None:
        return []
    inner = [code for value in phrase.fields.values() if isinstance(value, Phrase) for code in codes(value)]
    return [phrase.code, *inner]
