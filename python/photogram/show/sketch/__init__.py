"""Declared plots, panels of marks; drawn on matplotlib axes, or directly as SVG."""
