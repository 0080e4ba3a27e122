"""Files: text, tables of commas, records of fixed columns, and the one writer of all results."""
