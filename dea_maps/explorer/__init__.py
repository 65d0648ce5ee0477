"""Interactive HTML pages of maps."""
