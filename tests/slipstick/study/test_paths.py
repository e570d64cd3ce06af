"""Which path a study goes on with, and which it takes, by how well each set of effects is said to explain."""

from typing import Any

import pytest

from slipstick.study import paths
from slipstick.study.settings import StudySettings

HEIGHT = {"A": 20, "B": 15, "AB": 26, "BC": 20, "AC": 27, "ABC": 29, "AD": 40}


def path(*added: str) -> paths.Path:
    """A path that added the effects one after the other."""
    return paths.ended([{"added": list(added[:count])} for count in range(len(added) + 1)], "nothing more")


@pytest.fixture(autouse=True)
def explained(monkeypatch: pytest.MonkeyPatch) -> None:
    """A set of effects is better by 5 or more, an effect needed where the others come less near than that."""
    def better(settings: Any, comparison: Any, one: Any, other: Any) -> bool:
        then, now = (HEIGHT["".join(sorted(each["added"]))] for each in (one, other))
        return now >= then + 5

    def needed(settings: Any, comparison: Any, last: Any, place: int) -> bool:
        rest = [*last["added"][:place], *last["added"][place + 1:]]
        return better(settings, comparison, {"added": rest}, last)

    def going_on(settings: Any, comparison: Any, rounds: Any, effect: str) -> Any:
        return [*rounds, {"added": [*rounds[-1]["added"], effect]}]

    monkeypatch.setattr(paths, "better", better)
    monkeypatch.setattr(paths, "_needed", needed)
    monkeypatch.setattr(paths, "_going_on", going_on)
    monkeypatch.setattr(paths, "_with_another_first", lambda *_: None)


def another(*tried: paths.Path) -> tuple[list[paths.Path], Any]:
    return paths.another(StudySettings(), None, list(tried))  # type: ignore[arg-type]


def best(*tried: paths.Path) -> int:
    return paths.best(StudySettings(), None, list(tried))  # type: ignore[arg-type]


def test_a_path_whose_effects_are_all_needed_stays() -> None:
    tried, begun = another(path("A", "B"))
    assert begun is None
    assert not tried[0]["gives_way"]


def test_an_effect_that_is_not_needed_gives_its_place_to_the_next() -> None:
    tried, begun = another(path("A", "B", "C"))
    assert tried[0]["gives_way"]
    assert begun[-1]["added"] == ["A", "C"]
    assert begun[:2] == path("A")["rounds"]


def test_no_path_is_begun_twice() -> None:
    assert another(path("A", "C"), path("A", "B", "C"))[1] is None


def test_what_gave_way_comes_back_only_if_it_is_so_much_better() -> None:
    gave = {**path("A", "B"), "gives_way": True}
    assert best(gave, path("A", "C")) == 1
    assert best(gave, path("B")) == 0
    # Without that, another path must be better itself.
    assert best(path("A", "B"), path("A", "C")) == 0
    assert best(path("A", "B"), path("A", "D")) == 1
