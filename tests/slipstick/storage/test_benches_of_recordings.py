"""The bench of recordings and models is found in the folder by its current profiles and by its physics."""

from dataclasses import replace

import pytest

from slipstick.errors import UnknownName
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from tests.benches import COMPACT, HEAVY, TABLES


@pytest.mark.parametrize(("bench", "name"), [(HEAVY, "measured"), (COMPACT, "measured-compact")])
def test_shipped_recordings_and_benches_belong_together(bench, name) -> None:
    library = Library(TABLES)
    recordings = library.recording(name)
    assert library.bench_of_recordings(recordings) == bench.name
    assert library.bench_of_model(bench.physics) == bench.name
    assert recordings.conditions.digest == bench.conditions.digest


def test_other_profiles_have_no_bench() -> None:
    recordings = Library(TABLES).recording("measured-compact")
    for factor, profiles in ((1.01, slice(None)), (1.0, slice(0, 1))):
        conditions = recordings.conditions
        other = replace(conditions.take([0]), profile_time=conditions.profile_time[profiles],
                        profile_current=factor * conditions.profile_current[profiles])
        with pytest.raises(UnknownName, match="No bench"):
            Library(TABLES).bench_of_recordings(Recordings(other, recordings.measured_time[:1]))
