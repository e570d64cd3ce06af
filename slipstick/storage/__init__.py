"""Storage: untrusted HDF5, atomic replacement of files, limited child processes, and the library of a service.

`hdf5`, `files` and `isolated` do not depend on the content of the files. `condition_layout` is the part of the HDF5
layout that tables and recordings share, and `library` opens both by name.
"""

__all__ = ["condition_layout", "files", "hdf5", "isolated", "library"]
