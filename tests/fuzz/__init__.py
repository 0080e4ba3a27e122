"""A fuzzer that knows the formats: sound inputs of every program with damaged values."""
