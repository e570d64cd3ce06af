"""Recordings from the files of data-acquisition systems: MDF, MATLAB, CSV and Parquet, by a mapping."""

from slipstick.acquisition.guess import propose, propose_for_machine
from slipstick.acquisition.importing import import_sources
from slipstick.acquisition.machine_import import import_runs
from slipstick.acquisition.machine_mapping import open_machine_mapping, read_machine_mapping
from slipstick.acquisition.mapping_file import open_mapping, read_mapping
from slipstick.acquisition.opening import open_source
from slipstick.acquisition.result import Imported, ImportedRuns

__all__ = ["Imported", "ImportedRuns", "import_runs", "import_sources", "open_machine_mapping", "open_mapping",
           "open_source", "propose", "propose_for_machine", "read_machine_mapping", "read_mapping"]
