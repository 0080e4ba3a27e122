"""Pictures as they are declared, panels of marks; drawn on axes of matplotlib, or straight as SVG."""
