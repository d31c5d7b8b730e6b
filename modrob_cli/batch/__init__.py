"""Many logs: the same task for each, in one process, in several or on a Dask cluster; resumable, written whole."""
