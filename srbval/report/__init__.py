"""Reports: their sections, tables and figures as data, and renderers that write them as HTML and PDF."""
