"""The timing of a run: exact in simulated time, read back from any record, told and drawn."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from torquerig import load_configuration, run_experiment
from torquerig.cli import main
from torquerig.control import LoopLog, ReferenceTable
from torquerig.experiment import Outcome
from torquerig.records import open_record
from torquerig.results import Results
from torquerig.scheduling import Step
from torquerig.simulator import begin_record
from torquerig.timing import Timing, cycle_times, timing_of

SYNC_NS, SAMPLE_NS = 55_000, 20_000  # 55 bits at 1 Mbit/s; [drive].sample
TPDO_NS, SHORT_TPDO_NS, HEARTBEAT_NS = 135_000, 95_000, 65_000  # 8, 4 and 1 bytes, bit stuffing at its worst
THESIS_LAW_NS = 3_180_000
NEW_COLUMNS = ["law_ns", "tpdo_ns_1", "tpdo_ns_2", "tpdo_ns_3"]
PERIOD_NS = 1_000_000


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch) -> Path:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("COLUMNS", "120")
    return tmp_path / "here"


@pytest.fixture(scope="module")
def outcome(tmp_path_factory) -> Outcome:
    return run_experiment(load_configuration(), record=tmp_path_factory.mktemp("timing") / "run")


@pytest.fixture
def copy(outcome, tmp_path) -> Path:
    return shutil.copytree(outcome.record, tmp_path / "copy")


@pytest.fixture
def log() -> LoopLog:
    """A thousand cycles of 1 ms whose SYNC is 1 to 1000 us late, answered 100 us and commanded 300 us after it."""
    n = 1000
    plane, joints = np.zeros((n, 2)), np.zeros((n, 3))
    table = ReferenceTable(PERIOD_NS, plane, plane, plane, joints, joints, np.ones(n, dtype=np.bool_))
    log = LoopLog.for_table(table)
    log.rows = n
    log.complete[:] = True
    log.lateness_ns[:] = 1000 * np.arange(1, n + 1)
    log.sample_ns[:] = log.lateness_ns + 100_000
    log.command_ns[:] = log.lateness_ns + 300_000
    log.law_ns[:] = 7000
    log.tau[:] = 0.0
    log.tpdo_ns[:] = (50_000, 60_000, 90_000)
    return log


def printed(capsys, *arguments: object) -> str:
    assert main([str(each) for each in arguments]) == 0
    return capsys.readouterr().out


def rewrite(place: Path, **columns: dict[int, object]) -> None:
    """Change single values of cycles.parquet: rows by column."""
    path = place / "cycles.parquet"
    table = pq.read_table(path)
    for name, changed in columns.items():
        at = table.schema.get_field_index(name)
        values = table[name].to_pylist()
        for row, value in changed.items():
            values[row] = value
        table = table.set_column(at, table.schema.field(at), pa.array(values, table.schema.field(at).type))
    pq.write_table(table, path)


def make_old(place: Path) -> None:
    """Make a record what it was before it held all times."""
    pq.write_table(pq.read_table(place / "cycles.parquet").drop_columns(NEW_COLUMNS), place / "cycles.parquet")
    facts = json.loads((place / "run.json").read_text(encoding="utf-8"))
    del facts["real_time"], facts["summary"]["timing"]
    (place / "run.json").write_text(json.dumps(facts), encoding="utf-8")


def assert_held_up_by_heartbeats_alone(tpdo_ns: np.ndarray, undisturbed_ns: int, heartbeats_ns: int) -> None:
    """Most answers come when they must; a few may wait for the heartbeats of three drives and a master."""
    assert np.min(tpdo_ns) == undisturbed_ns
    assert np.mean(tpdo_ns == undisturbed_ns) > 0.9
    assert np.max(tpdo_ns) <= undisturbed_ns + heartbeats_ns


def test_in_simulated_time_every_drive_answers_to_the_nanosecond(outcome):
    for place in range(3):
        assert set(outcome.log.tpdo_ns[:, place]) == {SYNC_NS + SAMPLE_NS + (place + 1) * TPDO_NS}
    assert set(outcome.log.sample_ns) == {SYNC_NS + SAMPLE_NS + 3 * TPDO_NS}
    assert set(outcome.log.lateness_ns) == {0}
    assert set(outcome.log.command_ns) == {THESIS_LAW_NS}


def test_half_the_bit_rate_takes_twice_as_long_on_the_wire():
    log = run_experiment(load_configuration(options={"bus.bitrate": 500_000, "loop.law": "coupled-pd"})).log
    for place in range(3):
        undisturbed_ns = 2 * SYNC_NS + SAMPLE_NS + (place + 1) * 2 * TPDO_NS
        assert_held_up_by_heartbeats_alone(log.tpdo_ns[:, place], undisturbed_ns, 4 * 2 * HEARTBEAT_NS)


def test_short_tpdos_of_a_group_are_there_sooner():
    log = run_experiment(load_configuration(options={"loop.group_rpdo": True})).log
    for place in range(3):
        undisturbed_ns = SYNC_NS + SAMPLE_NS + (place + 1) * SHORT_TPDO_NS
        assert_held_up_by_heartbeats_alone(log.tpdo_ns[:, place], undisturbed_ns, 4 * HEARTBEAT_NS)


def test_the_summary_tells_what_the_log_holds(outcome):
    told = outcome.summary.as_json()["timing"]
    assert set(told) == {
        "lateness_us", "sync_to_last_tpdo_us", "law_us", "sync_to_last_rpdo_us", "tpdo_us_by_drive", "overruns_at_s",
    }  # fmt: skip
    assert told["lateness_us"] == {"p50": 0.0, "p99": 0.0, "p999": 0.0, "max": 0.0}
    assert set(told["sync_to_last_tpdo_us"].values()) == {480.0}
    assert set(told["sync_to_last_rpdo_us"].values()) == {3180.0}
    assert [drive["p999"] for drive in told["tpdo_us_by_drive"]] == [210.0, 345.0, 480.0]
    assert told["overruns_at_s"] == []
    assert 0 < told["law_us"]["p50"] <= told["law_us"]["p99"] <= told["law_us"]["p999"] <= told["law_us"]["max"]


def test_percentiles_are_those_of_the_cycles(log):
    timing = timing_of(log)
    told = timing.lateness_us
    assert (told.p50, told.p99, told.p999, told.max) == pytest.approx((500.5, 990.01, 999.001, 1000.0))
    assert timing.sync_to_last_tpdo_us.max == pytest.approx(100.0)
    assert timing.sync_to_last_rpdo_us.p50 == pytest.approx(300.0)
    assert [drive.p99 for drive in timing.tpdo_us_by_drive] == [50.0, 60.0, 90.0]


def test_overruns_are_stamped_by_when_they_were_due(log):
    log.command_ns[:] = 500_000
    log.command_ns[250] = PERIOD_NS + 1
    log.skip(999, 5_000_000)
    assert timing_of(log).overruns_at_s == (0.250, 0.999)


def test_skipped_and_unanswered_cycles_have_no_times(log):
    log.skip(999, 5_000_000)
    log.tpdo_ns[999] = math.nan
    log.complete[3], log.tpdo_ns[3, 1] = False, math.nan
    times = cycle_times(log)
    assert times.lateness.size == times.last_rpdo.size == 999
    assert times.last_tpdo.size == 998
    assert [drive.size for drive in times.tpdo_by_drive] == [999, 998, 999]


def test_a_cycle_that_a_limit_ended_has_no_torques_to_time(log):
    log.rows = 10
    log.tau[9], log.law_ns[9], log.command_ns[9] = math.nan, math.nan, 0
    times = cycle_times(log)
    assert (times.lateness.size, times.law.size, times.last_rpdo.size) == (10, 9, 9)


def test_of_a_run_without_a_cycle_there_is_no_number(log):
    log.rows = 0
    timing = timing_of(log)
    assert math.isnan(timing.lateness_us.p50)
    assert timing.as_json()["law_us"] == {"p50": None, "p99": None, "p999": None, "max": None}
    assert timing.tpdo_us_by_drive == ()


def test_timing_comes_back_from_its_json(log):
    timing = timing_of(log)
    assert Timing.from_json(json.loads(json.dumps(timing.as_json()))) == timing


def test_the_command_tells_and_draws_a_record(capsys, outcome, elsewhere):
    text = printed(capsys, "timing", outcome.record)
    assert "102 cycles of 4000 µs" in text
    assert "SYNC to TPDO, drive of axis 3" in text
    assert "345.0" in text
    assert "Overruns: none" in text
    assert "Picture: torquerig-timing.png" in text
    assert (elsewhere / "torquerig-timing.png").read_bytes().startswith(b"\x89PNG")


def test_with_json_it_prints_one_object_and_draws_only_when_asked(capsys, outcome, elsewhere):
    told = json.loads(printed(capsys, "timing", outcome.record, "--json"))
    assert told["timing"] == json.loads(json.dumps(outcome.summary.as_json()["timing"]))
    assert (told["cycles"], told["incomplete"], told["overruns"], told["real_time"]) == (102, 0, [], [])
    assert list(elsewhere.iterdir()) == []


def test_overruns_of_a_record_are_listed_with_their_stamps(capsys, copy):
    late = dict.fromkeys(range(20, 32), 4_000_001)
    rewrite(copy, command_ns=late, skipped={50: True}, lateness_ns={50: 9_000_000})
    told = json.loads(printed(capsys, "timing", copy, "--json"))
    start_s = open_record(copy).log.start_ns / 1e9
    assert [each["cycle"] for each in told["overruns"]] == [*range(20, 32), 50]
    first, last = told["overruns"][0], told["overruns"][-1]
    assert (first["at_s"], first["skipped"], first["command_us"]) == (0.080, False, 4000.001)
    assert first["stamp_s"] == pytest.approx(start_s + 0.080)
    assert (last["at_s"], last["skipped"], last["lateness_us"], last["command_us"]) == (0.200, True, 9000.0, None)
    text = printed(capsys, "timing", copy, "--picture", "t.png")
    assert Path("t.png").exists()
    assert "overruns: 13 of 102 cycles" in text
    assert "and 3 more: --json has them all" in text


def test_a_record_from_before_these_times_is_told_without_them(capsys, copy):
    make_old(copy)
    record = open_record(copy)
    assert np.isnan(record.log.tpdo_ns).all()
    assert record.summary.timing is None
    told = json.loads(printed(capsys, "timing", copy, "--json"))["timing"]
    assert told["tpdo_us_by_drive"] == []
    assert told["law_us"]["p50"] is None
    assert "ended" in printed(capsys, "show", copy, "--json")


def test_of_skipped_cycles_alone_overruns_are_told_and_nothing_is_drawn(capsys, copy, elsewhere):
    rewrite(copy, skipped=dict.fromkeys(range(102), True))
    text = printed(capsys, "timing", copy)
    assert "overruns: 102 of 102 cycles" in text
    assert list(elsewhere.iterdir()) == []


def test_a_record_of_simulated_drives_has_no_timing(capsys, tmp_path):
    begin_record(load_configuration(), tmp_path / "sim").write(origin_ns=0, lost=0)
    assert main(["timing", str(tmp_path / "sim")]) == 2
    assert "is a record of simulated drives: it has no cycles of a loop" in capsys.readouterr().err


def test_the_record_says_what_the_real_time_set_up_did_and_what_was_refused(tmp_path):
    results = Results(load_configuration())
    results.real_time = (Step("timer slack", done=True, words="1 ns"), Step("memory lock", done=False, words="no"))
    results.write(tmp_path, "done")
    assert json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))["real_time"] == [
        {"name": "timer slack", "done": True, "words": "1 ns"},
        {"name": "memory lock", "done": False, "words": "no"},
    ]
    assert open_record(tmp_path).real_time == results.real_time
