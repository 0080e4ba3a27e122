"""Data snooping: gross errors found one after the other and taken out, whatever the observations are of."""
