"""Recordings from the files of data-acquisition systems: MDF, MATLAB, CSV and Parquet, by a mapping."""

from slipstick.acquisition.guess import propose
from slipstick.acquisition.importing import import_sources
from slipstick.acquisition.mapping_file import open_mapping, read_mapping
from slipstick.acquisition.opening import open_source
from slipstick.acquisition.result import Imported

__all__ = ["Imported", "import_sources", "open_mapping", "open_source", "propose", "read_mapping"]
