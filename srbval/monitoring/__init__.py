"""Many records of machines: files analysed in parallel, tables of features, trends, one verdict on a machine."""
