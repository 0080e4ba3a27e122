"""An accuracy statement: what a surveyor hands to a client about an adjusted block and its check points."""
