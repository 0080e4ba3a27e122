"""Accuracy statements for clients on adjusted blocks and their check points."""
