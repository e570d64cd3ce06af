"""The numbers of the README are those of the present result: of a study and fits of the shipped recordings."""

import re
from pathlib import Path

import pytest

import slipstick
from evidence.tables import read_rates
from slipstick.interface.fit import Fit
from slipstick.interface.study import Study
from slipstick.studies.confidence import count_right

ROOT = Path(__file__).parents[1]
TEXT = " ".join((ROOT / "README.md").read_text().replace(">", "").split())


@pytest.fixture(scope="module")
def fits(sample_study: Study) -> dict[str, Fit]:
    bench, runs = slipstick.Bench.open("heavy"), slipstick.Recordings.open("sample")
    fitted = {}
    for which, model in (("before", sample_study.refitted), ("after", sample_study.extended)):
        table = slipstick.build(bench, {"initial_position": (0.5, 2, 50)}, model=model, conditions=runs, progress=False)
        fitted[which] = slipstick.fit(table, runs, progress=False)
    return fitted


def test_the_answer_and_the_gap_are_those_of_the_study(sample_study: Study) -> None:
    result = sample_study.result
    assert f"{sample_study.answer}." in TEXT
    assert result.gap is not None
    assert result.gap.control is not None
    gap, control = result.gap.closures["shifting_time"], result.gap.control.closures["shifting_time"]
    assert f"falls from {1e3 * gap.rms_before:.1f} to {1e3 * gap.rms_after:.1f} ms" in TEXT
    assert f"alone leave {1e3 * gap.rms_expected:.1f} ms" in TEXT
    assert f"as a control, leaves {1e3 * control.rms_after:.1f} ms" in TEXT
    (finding,) = sample_study.findings
    assert finding.law is not None
    span = re.search(r"falls by ([\d.]+) % as the slip of the plates grows", repr(finding.law))
    assert span
    assert span[0] in TEXT


def test_the_confidence_is_that_of_the_finding(sample_study: Study) -> None:
    (finding,) = sample_study.findings
    assert finding.confidence is not None
    band = count_right(finding.confidence)
    assert f"a confidence of {finding.confidence:.2f}: of {band.of} findings" in TEXT
    assert f"effects, {band.right} were right" in TEXT


def test_the_fits_are_those_of_both_models(fits: dict[str, Fit]) -> None:
    for which, words in (("before", "likelihood is {}, and the position scatters by {} %"),
                         ("after", "with it, {} and {} %")):
        likelihood = f"{fits[which].log10_likelihood:.1f}".replace("-", "−")
        scatter = fits[which].std[0] / fits[which].mean[0]
        assert words.format(likelihood, f"{100 * scatter:.0f}") in TEXT


def test_the_rates_are_those_of_the_table() -> None:
    rates = {(rate.suite, rate.what): rate for rate in read_rates(ROOT / "evidence" / "rates.csv")
             if rate.stage == "reported"}
    wrong = rates["nothing_missing", "something said to be missing"]
    right = rates["one_known_effect", "visible: right first"]
    assert f"of {wrong.of} in which nothing was missing, it said of {wrong.hits} that something was" in TEXT
    assert f"of {right.of} with one visible effect of the catalogue, it named it first in {right.hits}" in TEXT


def test_it_is_short() -> None:
    assert len((ROOT / "README.md").read_text().split("## Further reading")[0].split()) < 750
