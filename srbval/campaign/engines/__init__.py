"""Where cases run: in this process, in processes beside it, on a Dask cluster; one small interface for all."""
