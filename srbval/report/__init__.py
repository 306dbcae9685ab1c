"""Reports: sections, tables and figures as data, made from results, and renderers to HTML and PDF."""
