"""Values on several occasions: tests for changes, their document and control charts."""
