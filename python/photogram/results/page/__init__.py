"""The report of an adjusted network for the browser, part by part."""
