"""Plot tables, read and written."""
