"""The network: photos, points, cameras and what was observed, as arrays; their geometry."""
