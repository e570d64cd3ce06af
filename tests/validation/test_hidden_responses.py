"""Responses of sensors and plays of the valve of the simulated test benches delay a signal as they should."""

import numpy as np
import pytest
from hidden.nominal import HEAVY
from hidden.responses import RANGE, RESPONSES
from hidden.valve import play, plays

NOT_LATE = ("friction", "changes", "sludge", "adapt", "collapse", "slip", "clock",
            "wake", "tooth", "hammer", "divide", "peak", "blind", "paste", "share",
            "relax", "opens", "warms", "swings", "clings", "locks", "silts", "doubts",
            "bubbles", "waits", "chokes", "wipes", "tracks", "gaps",
            "sets", "predicts", "bleeds", "queues")  # on a ramp by a time of its own


@pytest.mark.parametrize("kind", [kind for kind in RESPONSES if kind not in NOT_LATE])
def test_a_response_delays_a_ramp_and_passes_a_constant(kind: str) -> None:
    ramp = np.minimum(20 + 30 * HEAVY.time, 65)[None]
    late = RESPONSES[kind](ramp, 0.01, "input_speed", HEAVY)
    lag = (ramp - late)[0, 500] / 30
    expected = {"delay": 0.01, "ring": 0.01, "slew": 0, "count": 0.01 * 55 / (50 + 0.15 * 55), "hold": 0,
                "fall": 0, "rise": 0.01, "average": 0.01, "carry": 0.01, "window": 0.01, "creep": 0.01,
                "strain": 0.01 * (50 / 55) ** 2, "switch": 0.001, "turns": 0.032 * 0.75**3,
                "band": 0.0005, "echo": 0.01, "lead": 0.01}
    assert lag == pytest.approx(expected[kind], abs=0.0011)
    assert late[0, -1] == pytest.approx(65, abs=1e-3 if kind == "creep" else None)  # whose slow part takes long


def test_a_slew_limit_holds_the_rate() -> None:
    step = np.where(HEAVY.time > 0.5, 165.0, 0.0)[None]
    late = RESPONSES["slew"](step, 0.02, "input_speed", HEAVY)
    assert np.max(np.diff(late)) == pytest.approx(165 / 0.2 * HEAVY.period)


def test_a_held_value_is_late_by_the_strength_on_average() -> None:
    ramp = 30 * HEAVY.time[None]
    lag = (ramp - RESPONSES["hold"](ramp, 0.01, "input_speed", HEAVY))[0] / 30
    assert np.mean(lag[100:]) == pytest.approx(0.01, abs=HEAVY.period)
    assert np.max(lag) == pytest.approx(0.02, abs=1.1 * HEAVY.period)


def test_a_falling_signal_is_late_by_the_strength() -> None:
    ramp = 65 - 30 * HEAVY.time[None]
    late = RESPONSES["fall"](ramp, 0.01, "input_speed", HEAVY)
    assert (late - ramp)[0, 500] / 30 == pytest.approx(0.01, abs=0.0011)


def test_a_rising_signal_is_late_by_the_strength_and_an_averaged_one_by_half_the_gate() -> None:
    step = np.where(HEAVY.time > 0.5, 165.0, 0.0)[None]
    averaged = RESPONSES["average"](step, 0.01, "input_speed", HEAVY)[0]
    assert np.interp(82.5, averaged[245:275], HEAVY.time[245:275]) == pytest.approx(0.511, abs=1e-3)
    assert averaged[263] == pytest.approx(165)
    rising = RESPONSES["rise"](step, 0.01, "input_speed", HEAVY)[0]
    assert np.sum(165 - rising[251:]) * HEAVY.period == pytest.approx(165 * 0.01, rel=0.15)
    np.testing.assert_array_equal(RESPONSES["rise"](-step, 0.01, "input_speed", HEAVY), -step)


@pytest.mark.parametrize("kind", ["friction", "changes"])
def test_a_gauge_with_play_and_a_bus_that_sends_on_a_change_stay_within_a_band(kind: str) -> None:
    ramps = 30 * np.abs(HEAVY.time - 1)[None]
    band = 165 / 0.3 * 0.004
    reading = RESPONSES[kind](ramps, 0.004, "input_speed", HEAVY)
    assert np.max(np.abs(reading - ramps)) == pytest.approx(band, abs=30 * HEAVY.period)
    assert np.mean(np.diff(reading) == 0) > (0.95 if kind == "changes" else 0.05)


def test_sludge_holds_a_band_back_and_a_filter_that_adapts_hardly_lags_behind_a_fast_ramp() -> None:
    slow, fast = (np.minimum(rate * HEAVY.time, 160)[None] for rate in (1, 150))
    reading = RESPONSES["sludge"](slow, 0.004, "input_speed", HEAVY)
    assert (slow - reading)[0, -1] == pytest.approx(165 / 0.4 * 0.004, rel=0.05)
    late = [(ramp - RESPONSES["adapt"](ramp, 0.02, "input_speed", HEAVY))[0, 500] / rate
            for rate, ramp in ((1, slow), (150, fast))]
    assert 0 < late[1] < 0.4 * late[0] <= 0.4 * 0.05


def test_a_flat_hose_lags_at_low_values_only() -> None:
    ramp = 100 * HEAVY.time[None]
    late = (ramp - RESPONSES["collapse"](ramp, 0.01, "input_speed", HEAVY))[0] / 100
    assert late[150] == pytest.approx(0.05, rel=0.1)
    assert late[500] == pytest.approx(0.0005, abs=0.0011)


def test_a_slow_clock_delays_in_proportion_to_time() -> None:
    ramp = 60 * HEAVY.time[None]
    late = (ramp - RESPONSES["clock"](ramp, 0.01, "input_speed", HEAVY))[0] / 60
    np.testing.assert_allclose(late[[0, 100, 200, 400]], [0, 0.005, 0.01, 0.02], atol=1e-6)


def test_a_greasy_port_sticks_within_a_band_and_slips_through_it() -> None:
    ramps = 60 * np.abs(HEAVY.time - 1)[None]
    missing = np.abs(ramps - RESPONSES["slip"](ramps, 0.02, "input_speed", HEAVY))
    band = 165 / 0.2 * 0.02
    assert np.max(missing) == pytest.approx(band, abs=60 * HEAVY.period)
    assert np.min(missing[0, 200:450]) == pytest.approx(band / 8, rel=0.2)
    step = np.where(HEAVY.time > 0.5, 165.0, 0.0)[None]
    slipping = RESPONSES["slip"](step, 0.01, "input_speed", HEAVY)[0]
    assert np.interp(165 * (1 - np.exp(-2)), slipping, HEAVY.time) == pytest.approx(0.51, abs=1.1 * HEAVY.period)


def test_a_transmitter_that_wakes_up_reads_ever_more_often_and_holds_the_value() -> None:
    ramp = 30 * HEAVY.time[None]
    late = (ramp - RESPONSES["wake"](ramp, 0.01, "input_speed", HEAVY))[0] / 30
    assert np.all(late >= -1e-9)
    at = np.searchsorted(HEAVY.time, [0.2, 0.4, 1.0, 1.2])
    assert np.max(late[at[0]:at[1]]) == pytest.approx(0.02, rel=0.5)
    assert np.max(late[at[2]:at[3]]) == pytest.approx(0.006, abs=1.1 * HEAVY.period)


def test_a_speed_from_the_last_two_teeth_is_late_by_more_at_low_speed() -> None:
    third = RESPONSES["tooth"](np.full((1, len(HEAVY.time)), 55.0), 0.01, "input_speed", HEAVY)
    np.testing.assert_allclose(third, 55)
    reading = RESPONSES["tooth"](60 * HEAVY.time[None], 0.01, "input_speed", HEAVY)[0]
    late = HEAVY.time - reading / 60
    spans = [HEAVY.time > 1.5, (HEAVY.time > 0.4) & (HEAVY.time < 0.8)]
    assert [np.mean(late[span]) for span in spans] == pytest.approx([1.1 / 105, 1.1 / 36], rel=0.15)
    assert np.max(np.diff(np.flatnonzero(np.diff(reading)))[-10:]) == pytest.approx(1.1 / 119 / HEAVY.period, abs=1.5)


def test_a_hose_with_a_dead_end_doubles_a_step_in_part_and_comes_to_rest() -> None:
    step = np.where(HEAVY.time > 0.5, 100.0, 0.0)[None]
    reading = RESPONSES["hammer"](step, 0.005, "input_speed", HEAVY)[0]
    np.testing.assert_allclose(np.interp([0.52, 0.55, 0.61, 0.67], HEAVY.time, reading), [0, 170, 51, 134.3], atol=1e-9)
    assert reading[-1] == pytest.approx(100, rel=1e-3)


def test_a_divider_of_pulses_makes_the_lag_long_above_a_quarter_of_the_range() -> None:
    ramp = 30 * HEAVY.time[None]
    late = (ramp - RESPONSES["divide"](ramp, 0.02, "input_speed", HEAVY))[0] / 30
    below, above = np.searchsorted(HEAVY.time, [1.36, 1.6])
    assert late[below] == pytest.approx(0.06 / 16, abs=0.0011)
    assert late[above] == pytest.approx(0.06 * 41.25 / 48, rel=0.15)


def test_a_transmitter_of_peaks_follows_a_rise_at_once_and_a_fall_late() -> None:
    pulse = np.where((HEAVY.time > 0.5) & (HEAVY.time < 0.8), 5.0, 1.0)[None]
    reading = RESPONSES["peak"](pulse, 0.01, "pressure", HEAVY)[0]
    assert np.all(reading[HEAVY.time < 0.8] == pulse[0, HEAVY.time < 0.8])
    assert HEAVY.time[np.flatnonzero(reading > 3)[-1]] == pytest.approx(0.86, abs=1.5 * HEAVY.period)


def test_a_counter_is_blind_at_each_change_of_its_range() -> None:
    ramp = 30 * HEAVY.time[None]
    reading = RESPONSES["blind"](ramp, 0.01, "output_speed", HEAVY)[0]
    blind = np.flatnonzero(reading != ramp[0])
    assert len(blind) * HEAVY.period == pytest.approx(3 * 0.08, abs=4 * HEAVY.period)
    starts = HEAVY.time[blind[np.diff(blind, prepend=-2) > 1]]
    np.testing.assert_allclose(starts, [0.25, 0.5, 1.0], atol=2 * HEAVY.period)


def test_a_paste_creeps_after_a_small_change_and_yields_to_a_large_one() -> None:
    reading = {}
    for change in (0.001, 8.0):
        step = np.where(HEAVY.time > 0.5, 1 + change, 1.0)[None]
        missing = (step - RESPONSES["paste"](step, 0.01, "pressure", HEAVY))[0] / change
        assert np.all((missing >= 0) & (missing <= 1))
        reading[change] = np.sum(missing) * HEAVY.period
    assert reading[0.001] == pytest.approx(0.1, rel=0.05)
    assert reading[8.0] < 0.01


def test_a_value_is_sent_when_a_share_of_it_has_changed() -> None:
    ramp = 30 * HEAVY.time[None]
    reading = RESPONSES["share"](ramp, 0.01, "output_speed", HEAVY)[0]
    sent = np.unique(reading)
    late = sent > 8
    assert np.all(ramp[0] - reading <= np.maximum(0.08 * reading, 60 / 200))
    np.testing.assert_allclose(sent[late][1:] / sent[late][:-1], 1.08, atol=30 * HEAVY.period / 8)


def test_a_resin_yields_over_decades_of_time() -> None:
    step = np.where(HEAVY.time > 0.5, 10.0, 0.0)[None]
    missing = (step - RESPONSES["relax"](step, 0.02, "pressure", HEAVY))[0]
    for later in (0.03, 0.2, 0.8):
        left = 0.4 * np.sum(np.exp(-later / np.array([0.012, 0.072, 0.416])))
        assert np.interp(0.5 + later, HEAVY.time, missing) == pytest.approx(left, rel=0.03)


def test_a_filter_opens_after_the_command() -> None:
    ramp = 30 * HEAVY.time[None]
    late = (ramp - RESPONSES["opens"](ramp, 0.01, "output_speed", HEAVY))[0] / 30
    expected = 0.01 * (0.1 + 4 * np.exp(-HEAVY.time / 0.3))
    assert np.interp(0.6, HEAVY.time, late) == pytest.approx(np.interp(0.6, HEAVY.time, expected), rel=0.15)
    assert late[-1] == pytest.approx(0.001, abs=2e-4 + HEAVY.period)


def test_a_reading_falls_behind_a_step_and_comes_back() -> None:
    step = np.where(HEAVY.time > 0.5, 10.0, 0.0)[None]
    missing = (step - RESPONSES["warms"](step, 0.02, "pressure", HEAVY))[0]
    for later in (0.01, 0.06, 0.3, 0.8):
        left = 2.5 * (np.exp(-later / 0.12) - np.exp(-later / 0.04))
        assert np.interp(0.5 + later, HEAVY.time, missing) == pytest.approx(left, abs=0.05)


def test_a_fifth_of_a_reading_swings_about_a_step() -> None:
    step = np.where(HEAVY.time > 0.5, 10.0, 0.0)[None]
    missing = (step - RESPONSES["swings"](step, 0.016, "output_speed", HEAVY))[0]
    for turns in (1, 2, 3):
        expected = 2 * np.exp(-0.04 * 2 * np.pi * turns)
        assert np.interp(0.5 + 0.4 * turns, HEAVY.time, missing) == pytest.approx(expected, abs=0.06)
        assert np.interp(0.3 + 0.4 * turns, HEAVY.time, missing) < -1


def test_a_reading_clings_to_its_peaks() -> None:
    ramps = 12 * np.abs(HEAVY.time - 1)[None]
    left = (RESPONSES["clings"](ramps, 0.01, "pressure", HEAVY) - ramps)[0]
    assert np.max(left) == pytest.approx(18 * 0.01 / 0.3, rel=1e-6)
    turning = 1 + 0.6 / 12  # s, when the rising signal has reached the reading
    np.testing.assert_allclose(left[[25, 500]], [0.6, 0.6], atol=12 * HEAVY.period)
    np.testing.assert_allclose(left[HEAVY.time > turning + HEAVY.period], 0, atol=1e-9)


def test_a_loop_that_locks_swings_about_a_ramp_and_is_not_late_at_last() -> None:
    ramp = 30 * np.maximum(HEAVY.time - 0.2, 0)[None]
    missing = (ramp - RESPONSES["locks"](ramp, 0.01, "output_speed", HEAVY))[0]
    own, decay = (2 * np.pi / 0.3 * share for share in (np.sqrt(1 - 0.1**2), 0.1))
    for later in (0.04, 0.12, 0.2, 0.6):
        expected = 30 / own * np.sin(own * later) * np.exp(-decay * later)
        assert np.interp(0.2 + later, HEAVY.time, missing) == pytest.approx(expected, abs=0.03)


def test_a_screen_silts_up_with_what_has_moved_through_it() -> None:
    ramps = 12 * np.abs(HEAVY.time - 1)[None]
    left = (RESPONSES["silts"](ramps, 0.01, "pressure", HEAVY) - ramps)[0]
    assert np.all(left[HEAVY.time < 0.5] < 12 * 0.001)
    later = np.flatnonzero(HEAVY.time > 1.7)
    moved = (12 * HEAVY.time[later] / 18) ** 6
    np.testing.assert_allclose(-left[later] / 12, 0.01 * (0.05 + 20 * moved / (moved + 20)), atol=0.014)
    constant = np.full((1, len(HEAVY.time)), 5.0)
    np.testing.assert_array_equal(RESPONSES["silts"](constant, 0.01, "pressure", HEAVY), constant)


def test_a_fast_change_is_doubted_for_a_while_and_a_slow_one_is_not() -> None:
    slow = 50 * HEAVY.time[None]
    np.testing.assert_array_equal(RESPONSES["doubts"](slow, 0.01, "output_speed", HEAVY), slow)
    fast = np.interp(HEAVY.time, [0, 0.3, 0.8, 2], [0, 0, 50, 50])[None]
    reading = RESPONSES["doubts"](fast, 0.01, "output_speed", HEAVY)[0]
    doubted = (HEAVY.time > 0.301) & (HEAVY.time < 0.439)
    assert np.all(reading[doubted] == reading[doubted][0])
    assert fast[0][doubted][-1] > 13
    believed = HEAVY.time > 0.443
    np.testing.assert_array_equal(reading[believed], fast[0][believed])


def test_a_bubble_is_slow_at_a_low_pressure_and_dissolves_at_a_high_one() -> None:
    ramp = 18 * np.minimum(HEAVY.time, 1)[None]
    left = (ramp - RESPONSES["bubbles"](ramp, 0.01, "pressure", HEAVY))[0] / 18
    assert np.interp(0.125, HEAVY.time, left) == pytest.approx(0.013, abs=0.003)
    assert np.interp(0.05, HEAVY.time, left) > 0.02
    assert np.all(left[(HEAVY.time > 0.4) & (HEAVY.time < 1)] < 1e-3)
    constant = np.full((1, len(HEAVY.time)), 2.0)
    np.testing.assert_allclose(RESPONSES["bubbles"](constant, 0.01, "pressure", HEAVY), constant)


def test_a_recorder_that_waits_is_late_by_another_time_in_each_run() -> None:
    ramps = np.tile(20 * HEAVY.time, (100, 1))
    late = (HEAVY.time - RESPONSES["waits"](ramps, 0.01, "output_speed", HEAVY) / 20)[:, 500:]
    assert np.all(np.ptp(late, axis=1) < 1e-9)
    assert late.mean() == pytest.approx(0.01, rel=0.1)
    assert np.median(late) < 0.003
    assert 0.05 < late.max() < 0.06


def test_a_turbulent_bore_lets_the_root_of_what_is_missing_fall_evenly() -> None:
    step = np.where(HEAVY.time > 0.2, 8.0, 0.0)[None]
    root = np.sqrt(8 - RESPONSES["chokes"](step, 0.02, "pressure", HEAVY)[0])
    later = (HEAVY.time > 0.203) & (root > 1e-6)
    full = 0.2 / np.sqrt(RANGE["pressure"])
    np.testing.assert_allclose(np.diff(root[later]), -HEAVY.period / full, rtol=1e-6)
    assert np.sum(later) * HEAVY.period == pytest.approx(np.sqrt(8) * full, abs=2 * HEAVY.period)
    constant = np.full((1, len(HEAVY.time)), 5.0)
    np.testing.assert_array_equal(RESPONSES["chokes"](constant, 0.02, "pressure", HEAVY), constant)


def test_grease_holds_back_a_wheel_until_it_has_turned() -> None:
    ramp = 30 * HEAVY.time[None]
    late = (ramp - RESPONSES["wipes"](ramp, 0.01, "output_speed", HEAVY))[0] / 30
    assert np.interp(0.1, HEAVY.time, late) > 0.025
    assert late[-1] == pytest.approx(0.002, abs=0.0011)
    faster = (2 * ramp - RESPONSES["wipes"](2 * ramp, 0.01, "output_speed", HEAVY))[0] / 60
    assert np.interp(0.4, HEAVY.time, faster) < 0.7 * np.interp(0.4, HEAVY.time, late)


def test_a_shared_amplifier_follows_and_holds_by_turns() -> None:
    ramp = 10 * HEAVY.time[None]
    late = HEAVY.time - RESPONSES["tracks"](ramp, 0.02, "pressure", HEAVY)[0] / 10
    phase = np.mod(HEAVY.time / 0.16 + 1e-9, 1.0)
    np.testing.assert_allclose(late, np.maximum(phase - 0.5, 0) * 0.16, atol=1e-8)
    whole = HEAVY.time < 0.16 * np.floor(HEAVY.time[-1] / 0.16) - 1e-6
    assert np.mean(late[whole]) == pytest.approx(0.02, rel=0.05)


def test_a_gap_of_the_wheel_holds_the_reading_while_it_passes() -> None:
    constant = np.full((1, len(HEAVY.time)), 20.0)
    np.testing.assert_array_equal(RESPONSES["gaps"](constant, 0.02, "output_speed", HEAVY), constant)
    ramp = 20 + 5 * HEAVY.time[None]
    held = [np.diff(RESPONSES["gaps"](row, 0.02, "output_speed", HEAVY)[0]) == 0 for row in (ramp, 2 * ramp)]
    starts = [np.flatnonzero(row[1:] & ~row[:-1]) for row in held]
    assert np.mean(held[0]) == pytest.approx(0.25, abs=0.05)
    first = [HEAVY.time[row[0]] for row in starts]
    assert first[0] == pytest.approx(2 * first[1], rel=0.1)
    assert first[0] == pytest.approx(0.5 * 0.16 * 20 / 20.2, abs=0.01)


def test_oil_that_has_set_holds_back_the_reading_until_it_is_stirred() -> None:
    ramp = 14 * HEAVY.time[None]
    late = HEAVY.time - RESPONSES["sets"](ramp, 0.02, "pressure", HEAVY)[0] / 14
    assert late[20] == pytest.approx(HEAVY.time[20], rel=0.25)
    stirred = 0.1 * 14 / (18 / 12)  # at the end: what is stirred in the time over which the oil sets again
    assert late[-1] == pytest.approx(0.02 * (0.2 + 6 * np.exp(-stirred)), rel=0.1)
    rests = np.interp(HEAVY.time, [0, 0.5, 1.4, 1.9], [0, 7, 7, 14])[None]
    reading = RESPONSES["sets"](rests, 0.02, "pressure", HEAVY)[0]
    np.testing.assert_allclose(reading[HEAVY.time > 1.4][:150] - 7, reading[:150], atol=0.05)


def test_a_receiver_goes_on_as_straight_as_before() -> None:
    ramp = 20 + 5 * HEAVY.time[None]
    late = np.abs(RESPONSES["predicts"](ramp, 0.02, "output_speed", HEAVY) - ramp)[0]
    np.testing.assert_allclose(late[HEAVY.time >= 0.08], 0, atol=1e-9)
    assert late[39] == pytest.approx(5 * HEAVY.time[39])
    bent = np.interp(HEAVY.time, [0, 1, 2], [0, 50, 50])[None]
    beyond = RESPONSES["predicts"](bent, 0.02, "output_speed", HEAVY)[0]
    assert np.max(beyond) == pytest.approx(50 * 1.04, abs=0.2)
    np.testing.assert_allclose(beyond[HEAVY.time > 1.13], 50, atol=1e-9)


def test_a_ball_lets_a_rise_pass_and_a_leak_lets_out_a_fall_at_a_constant_rate() -> None:
    ramps = 14 * (1 - np.abs(HEAVY.time - 1))[None]
    reading = RESPONSES["bleeds"](ramps, 0.06, "pressure", HEAVY)[0]
    rises = (HEAVY.time > 0.3) & (HEAVY.time < 0.99)
    np.testing.assert_allclose((ramps[0] - reading)[rises], 14 * 0.02, rtol=0.1)
    np.testing.assert_allclose(np.diff(reading)[HEAVY.time[1:] > 1.1], -18 / 1.5 * HEAVY.period, rtol=1e-6)


def test_pulses_wait_in_a_queue_above_a_rate_until_it_is_thrown_away() -> None:
    slow, fast = (np.full((1, len(HEAVY.time)), 60 / 8 * rate) + 1e-3 * HEAVY.time for rate in (0.9, 2.0))
    np.testing.assert_allclose(RESPONSES["queues"](slow, 0.02, "output_speed", HEAVY), slow, atol=1e-9)
    late = (fast - RESPONSES["queues"](fast, 0.02, "output_speed", HEAVY))[0] / 1e-3
    np.testing.assert_allclose(late[:200], HEAVY.time[:200] / 2, atol=2e-3)
    assert np.max(late) == pytest.approx(12 * 0.02, abs=2 * HEAVY.period)
    assert np.sum(np.diff(late) < -0.1) == 4


def test_plays_in_parallel_are_averaged() -> None:
    time, current = np.array([[0.0, 1, 2, 3]]), np.array([[0.0, 1, 0, 1]])
    samples = np.linspace(0, 3, 31)
    single = [np.interp(samples, *(knots[0] for knots in play(time, current, width, width))) for width in (0.1, 0.3)]
    both = plays(time, current, np.array([0.1, 0.3]))
    np.testing.assert_allclose(np.interp(samples, both[0][0], both[1][0]), np.mean(single, axis=0), atol=1e-12)
