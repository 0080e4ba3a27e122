"""Control networks of ISIS, the planetary mapping system of the U.S. Geological Survey."""
