"""Files: text, CSV tables, records of fixed columns, and the writer of all results."""
