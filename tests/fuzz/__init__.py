"""A fuzzer that knows the formats: sound inputs of every program with damaged values."""

import os

# Before the numerical libraries are loaded: a worker is one thread.
for _name in ("RAYON_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
