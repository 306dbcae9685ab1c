"""Everything that the report shows, simulated, read, analysed and compared before anything is drawn."""
