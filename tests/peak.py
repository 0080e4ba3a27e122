"""Largest traced memory of a call."""

import gc
import tracemalloc


def peak_of(call):
    """Return the result of a call and its peak (bytes): the least of three calls.

    Other threads and finalizers of earlier tests can only increase a peak.
    """
    peaks = []
    for _ in range(3):
        gc.collect()
        tracemalloc.start()
        try:
            result = call()
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    return result, min(peaks)
