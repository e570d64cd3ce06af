"""Files: HDF5 that is not trusted, whole-file replacement, limited child processes, and the folder of a service.

`hdf5`, `files` and `isolated` know nothing of what is stored. `condition_layout` is the part of the layout that tables
and recordings share, and `library` opens both by name.
"""

__all__ = ["condition_layout", "files", "hdf5", "isolated", "library"]
