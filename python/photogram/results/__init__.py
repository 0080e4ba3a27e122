"""What an adjustment gives, as arrays, tables, text and JSON."""
