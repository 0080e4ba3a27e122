"""Files: text, CSV tables, records, and the writer of all results."""
