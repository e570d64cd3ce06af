"""Storage: untrusted HDF5, atomic replacement of files, limited child processes, databases, the library of a service.

`hdf5`, `files`, `children`, `isolated` and `database` do not depend on the content. `condition_layout` is the part of
the HDF5 layout that tables and recordings share, and `library` opens both by name.
"""

__all__ = ["children", "condition_layout", "database", "files", "hdf5", "isolated", "library"]
