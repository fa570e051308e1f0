"""The commands, and how they put the parts together."""

from radar_console.app.commands import main

__all__ = ["main"]
