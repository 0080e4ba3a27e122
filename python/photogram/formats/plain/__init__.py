"""The plain project: tables with a file of settings."""

SETTINGS = "project.toml"
