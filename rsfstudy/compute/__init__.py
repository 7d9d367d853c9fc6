"""From a study to its cells, computed in this process or by Dask workers."""
