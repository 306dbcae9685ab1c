"""The report: a tree of sections, tables and figures, and one thin renderer for each format."""
