"""The console: the only folder, with the app, that imports Qt."""
