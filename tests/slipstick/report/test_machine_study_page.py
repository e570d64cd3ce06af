"""What the report of a study of a machine says where findings are not told apart, or of the past of a signal."""

from dataclasses import replace

from slipstick.machine_studies.result import (
    MachineBlock,
    MachineFinding,
    MachineGap,
    MachineParameter,
    MachineStudyResult,
    Rival,
)
from slipstick.machine_studies.words import answer, name_finding
from slipstick.pictures.study.words import argument
from slipstick.report.machine_study import advise, lead, sections, tabulate_parameters, tell_evidence, warnings
from slipstick.report.study.parts import Items, Table
from slipstick.studies.finding import Coefficient, Law

FRICTION, LAG, PAST = ("friction torque", "speed"), ("current sensor", "lag"), ("voltage", "past voltage")
DRY, BRUSH = ("dry friction", "speed"), ("brush voltage", "past voltage")
LAW = Law([-200.0, 0.0, 400.0], "rad/s", [0.01, 0.0, -0.03], [0.0, -0.001, -0.04], [0.02, 0.001, -0.02], "N m", False,
          "nothing", linearised=False, formula=None)


def make_finding(pair: tuple[str, str], block: str, *rivals: tuple[str, str], law: Law | None = None,
                 behind: float = 1.0) -> MachineFinding:
    others = [Rival(name_finding(rival), *rival, 300.0, behind) for rival in rivals]
    return MachineFinding(name_finding(pair), *pair, None, None, None, [], [block], 400.0, 20.0, others, law, True)


def make_result(*findings: MachineFinding) -> MachineStudyResult:
    """Return the result of a study of a motor with these findings, whose blocks are explained and converged."""
    blocks = [MachineBlock(name, "in → out", 1.0, 3.0, unexplained=False) for name in ("winding", "shaft")]
    dry = MachineParameter("dry torque", "N m", 0.029, 0.028, 0.030, 0.001, determined=True, beyond=False,
                           declared=0.015)
    return MachineStudyResult("dc motor", "several", answer(findings, []), list(findings), blocks, [dry], None, [], 36,
                              {}, {"voltage": "V"}, "", "")


def tell_advice(result: MachineStudyResult) -> list[tuple[str, str]]:
    """Return the entries of the box with what to do."""
    return [entry for part in advise(result).parts if isinstance(part, Items) for entry in part.entries]


def tell_findings(result: MachineStudyResult) -> list[tuple[str, str]]:
    """Return the entries of the sections of the findings."""
    return [entry for section in sections(result, []) if section.title.startswith("Finding")
            for part in section.parts if isinstance(part, Items) for entry in part.entries]


def test_no_run_is_asked_to_stay_at_a_time_or_a_place_in_the_order() -> None:
    for on, runs in (("run order", "More runs improve it"), ("time", "More runs improve it"),
                     ("speed", "Runs that stay there improve it")):
        told = dict(tell_advice(make_result(make_finding(("dry friction", on), "shaft", law=LAW))))
        assert runs in told["Next experiment:"]


def test_an_equation_is_zero_at_a_value_that_is_named_without_an_article() -> None:
    law = replace(LAW, relative=True, unit="1", up_to="constant", formula=[0.01, 0.0, -0.03])
    finding = replace(make_finding(("dry friction", "armature speed"), "shaft", law=law), equation="change = ...")
    told = " ".join(text for _, text in tell_advice(make_result(finding)))
    assert "it is 0 where the armature speed is" in told


def test_what_a_law_is_over_has_the_words_of_the_machine() -> None:
    """Those of the clutch are of its own plates and shift commands."""
    assert [argument(make_finding(("friction torque", on), "shaft")) for on in ("slip", "time", "run order")] == [
        "slip", "time", "position in the run order"]


def test_what_explains_runs_that_are_set_aside_is_looked_for_there_and_not_added() -> None:
    few = replace(make_finding(FRICTION, "shaft", law=LAW), runs=[3, 8, 20], confirmed=None)
    result = replace(make_result(few), kind="unlisted", set_aside=[3, 8, 11, 20])
    assert result.sentence == "Missing: friction torque that depends on the speed, in the runs 3, 8, and 20 alone"
    told = dict(tell_advice(result))
    assert told["Find out what differs in these runs:"].startswith("3, 8 and 20. Friction torque that depends on the")
    assert not [lead_in for lead_in in told if "Add" in lead_in or "with the law" in lead_in]
    assert told["Next experiment:"].startswith("repeat the runs 3, 8 and 20 ")
    assert ("Set aside: run 11,", "numbered from 0: far worse than all others and not used, and not explained by what "
            "explains others of these. Look at the signals.") in warnings(result)
    assert "in the runs 3, 8 and 20 alone" in dict(tell_findings(result))["Where:"]
    both = make_result(make_finding(LAG, "winding", law=LAW), few)
    assert "2. Find out what differs in these runs:" in dict(tell_advice(both))
    assert "Take over with the law, not without it:" in dict(tell_advice(both))


def contest() -> MachineStudyResult:
    """Return a result with three findings, two of which are not told apart from others."""
    return make_result(make_finding(FRICTION, "shaft", DRY, LAG, law=LAW), make_finding(LAG, "shaft", PAST, BRUSH),
                       make_finding(PAST, "winding"))


def test_the_answer_tells_what_is_not_told_apart_without_the_other_findings() -> None:
    result = contest()
    assert result.sentence == (
        "Missing: friction torque that depends on the speed (or dry friction that depends on the speed), lag of the "
        "current sensor (or brush voltage that depends on the past voltage), and voltage that depends on the past "
        "voltage")
    first, _, last = result.findings
    assert answer([first], []) == "Missing: friction torque that depends on the speed (or 2 others)"
    assert answer([], ["winding", "shaft"]).startswith("Something is missing in the blocks “winding” and “shaft”, ")
    assert answer([replace(last, confirmed=False)], []).endswith(
        "past voltage (not confirmed by the simulation of the whole machine)")


def test_a_finding_without_a_law_has_its_time_or_is_to_be_looked_for() -> None:
    lag = make_finding(LAG, "winding")
    result = make_result(make_finding(FRICTION, "shaft", law=LAW), lag)
    advice = dict(tell_advice(result))
    by_law, by_hand = advice["1. Add:"], advice["2. Correct or model:"]
    assert by_law == "friction torque that depends on the speed, as the measured law."
    assert by_hand == ("lag of the current sensor: the recordings show it, and no equation of it is known. Correct "
                       "the sensor or its channel in the recordings, or add the error to the model.")
    assert "Add by hand:" in dict(tell_advice(make_result(make_finding(FRICTION, "shaft"))))
    contested = dict(tell_advice(make_result(make_finding(LAG, "winding", PAST))))
    assert contested["Do not correct yet:"].endswith(
        "Record first what tells it apart from voltage that depends on the past voltage.")
    known = replace(lag, kind="first-order lag", equation="change of the current sensor = ((x after ...) - x)",
                    coefficients=[Coefficient("time", "s", 0.012, 0.0114, 0.0126, at_bound=False)])
    table = next(part for part in advise(make_result(known)).parts if isinstance(part, Table))
    assert table.rows == [("time", "12.00 ms", "11.40 to 12.60 ms", "not in the model")]
    exact = replace(known, coefficients=[Coefficient("time", "s", 0.012, 0.0119998, 0.0120002, at_bound=False)])
    table = next(part for part in advise(make_result(exact)).parts if isinstance(part, Table))
    assert table.rows == [("time", "12.0000 ms", "11.9998 to 12.0002 ms", "not in the model")]


def test_nothing_is_to_be_added_or_taken_over_from_a_fit_that_has_not_converged() -> None:
    result = make_result(make_finding(FRICTION, "shaft", law=LAW))
    winding, shaft = result.blocks
    told = dict(tell_advice(replace(result, blocks=[winding, replace(shaft, converged=False)])))
    assert told["Do not add yet:"].endswith(" The fit of “shaft” has not converged.")
    assert not {"Add:", "Take over with the law, not without it:"} & set(told)


def test_parameters_are_taken_over_with_the_laws_and_not_at_all_where_a_block_leaves_much() -> None:
    result = make_result(make_finding(FRICTION, "shaft", law=LAW))
    assert "Take over with the law, not without it:" in dict(tell_advice(result))
    winding, shaft = result.blocks
    for left in (replace(winding, chi_square=2.5), replace(winding, unexplained=True)):
        entries = tell_advice(replace(result, blocks=[left, shaft]))
        assert not [lead for lead, _ in entries if lead.startswith("Take over")]
        first = next(text for lead, text in entries if lead == "Next experiment:")
        assert first == "check the units and the signs of the channels of “winding: in → out” first."


def test_a_rival_that_is_ahead_is_said_to_be_ahead() -> None:
    said = [dict(tell_findings(make_result(make_finding(LAG, "winding", PAST, behind=behind))))["Rivals:"]
            for behind in (-4.6, 4.6)]
    assert "(300 nats, ahead by 4.6 standard errors)" in said[0]
    assert "(300 nats, behind by 4.6 standard errors)" in said[1]


def test_the_next_experiment_sets_what_can_be_set() -> None:
    result = contest()
    entries = [text for lead, text in tell_advice(result) if lead == "Next experiment:"]
    assert entries == [
        "runs over the speed alone do not tell friction torque and dry friction apart. Change another condition that "
        "acts on a single one of them, or measure closer to it.", "a step of the voltage while all else is held."]
    other = make_result(make_finding(FRICTION, "shaft", ("load torque", "time")))
    assert dict(tell_advice(other))["Next experiment:"] == "runs in which speed and time do not change together."


def test_the_verdict_tells_which_findings_are_sure() -> None:
    result = contest()
    assert tell_evidence(result).startswith(
        "Sure: finding 3. Not sure: finding 1 (not told apart); finding 2 (not told apart). The runs agree")
    winding, shaft = result.blocks
    early = replace(result, blocks=[replace(winding, converged=False), replace(shaft, unexplained=True)])
    assert tell_evidence(early).startswith(
        "Sure: none of the findings. Not sure: finding 1 (not told apart and “shaft” leaves more than noise); ")
    last = replace(early, findings=result.findings[2:])
    assert tell_evidence(last).startswith("This is not sure: “winding” not converged. The runs agree")
    assert tell_evidence(make_result(*last.findings)).startswith("The runs agree")


def test_a_fit_that_did_not_converge_shows_no_closure() -> None:
    gap = MachineGap(786.0, -1.0, 1.0, "Offset of the speed sensor", 0.1, 5000.0, 80.0, converged=True)
    settled = replace(contest(), gap=gap)
    assert " What was found closes 100 % of the gap, a wrong law 10 %." in tell_evidence(settled)
    lost = replace(settled, gap=replace(gap, control_closed=None, control_converged=False))
    assert lead(lost).endswith("100 % of its gap to the recordings; the fit with a wrong law, added as a control, did "
                               "not converge.")
    assert " closes 100 % of the gap; the fit with a wrong law did not converge." in tell_evidence(lost)
    unknown = replace(lost, gap=replace(gap, closed=None, control_closed=None, converged=False))
    assert lead(unknown).endswith("is not known: a fit of it did not converge.")
    assert " is not known: a fit of the whole machine did not converge." in tell_evidence(unknown)
    assert "Not converged:" in dict(warnings(unknown))
    absent = replace(settled, gap=replace(gap, before=-832.0, after=-900.0, closed=None, control_closed=None))
    assert " There is no gap that it could close: " in tell_evidence(absent)
    assert lead(absent).startswith("There is no gap that it could close: ")
    assert "%" not in lead(absent)
    for result, shown in ((lost, ["", "100 %", "did not converge"]), (unknown, ["", *["did not converge"] * 2]),
                          (absent, ["", ""])):
        table = next(part for section in sections(result, []) if section.title.startswith("The gap")
                     for part in section.parts if isinstance(part, Table))
        assert [row[-1] for row in table.rows] == shown


def test_an_interval_without_width_at_a_bound_is_left_out() -> None:
    dry, = make_result().parameters
    narrow = replace(dry, value=0.029, lower=0.028999, upper=0.029001, beyond=True)
    table = tabulate_parameters([narrow, replace(narrow, beyond=False), replace(dry, beyond=True)])
    assert [row[3] for row in table.rows] == ["–", "0.0289990 to 0.0290010 N m", "0.02800 to 0.03000 N m"]


def test_a_column_of_remarks_is_left_out_where_all_are_empty() -> None:
    result = make_result()

    def tabulate(title: str, shown: MachineStudyResult) -> Table:
        section = next(each for each in sections(shown, []) if each.title == title)
        return next(part for part in section.parts if isinstance(part, Table))

    parameters = [replace(each, determined=True, beyond=False) for each in result.parameters]
    plain = replace(result, parameters=parameters, blocks=[replace(each, unexplained=False) for each in result.blocks])
    marked = replace(plain, parameters=[*parameters[1:], replace(parameters[0], beyond=True)],
                     blocks=[replace(result.blocks[0], unexplained=True), *plain.blocks[1:]])
    for title in ("Parameters", "Blocks"):
        without, having = tabulate(title, plain), tabulate(title, marked)
        assert (*without.head, "remark") == having.head
        assert {len(row) for row in without.rows} == {len(without.head)}
        assert having.words == (*without.words, len(without.head))


def test_few_runs_are_warned_about_and_a_shape_of_a_grid_has_no_interval() -> None:
    assert warnings(make_result()) == []
    (lead, text), = warnings(replace(make_result(), runs=11))
    assert lead == "Few runs: 11."
    assert "20 to 60" in text
    lag = replace(make_finding(LAG, "winding"), kind="first-order lag", equation="y", coefficients=[
        Coefficient("share", "1", 0.82, 0.79, 0.85, False), Coefficient("time", "s", 0.0136, 0.0136, 0.0136, False)])
    tables = [part for section in sections(make_result(lag), []) if section.title.startswith("Finding")
              for part in section.parts if isinstance(part, Table)]
    assert [row[1:] for row in tables[0].rows] == [("0.8200", "0.7900 to 0.8500"), ("13.60 ms", "–")]


def test_the_gain_error_of_a_sensor_is_told_over_its_readings() -> None:
    """It is a law in the unit of the signal, whose mean over readings of both signs says nothing."""
    law = replace(LAW, change=[-4.0, 0.0, 8.0], lower=[-4.1, -0.1, 7.9], upper=[-3.9, 0.1, 8.1], unit="rad/s")
    finding = make_finding(("speed sensor", "gain"), "shaft", law=law)
    text = " ".join(dict(part.entries)["Law:"] for section in sections(make_result(finding), [])
                    for part in section.parts if isinstance(part, Items) and "Law:" in dict(part.entries))
    assert text.startswith("The error of the speed sensor rises by 12 rad/s as the reading grows from -200 to 400 rad/s"
                           .replace("-", "−"))


def test_dry_friction_over_what_is_not_declared_to_come_to_rest_is_warned_about() -> None:
    rubbing = replace(make_finding(FRICTION, "shaft"), kind="Stribeck friction")
    [(said, remedy)] = warnings(make_result(rubbing))
    assert said == f"Dry friction: {name_finding(FRICTION)[0].lower()}{name_finding(FRICTION)[1:]}."
    assert "declare it among the `switches`" in remedy
    result = make_result(rubbing)
    winding, shaft = result.blocks
    assert not warnings(replace(result, blocks=[winding, replace(shaft, switches=["speed"])]))
    assert not warnings(make_result(replace(rubbing, kind="proportional")))
