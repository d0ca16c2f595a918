"""Answers are those of the program, on files and on what lies in memory."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pytest

import gyroid
from conftest import DATA, ROOT, answer


def without_file(answer: dict[str, Any]) -> dict[str, Any]:
    """All but the file: its name and its hash."""
    kept = {key: value for key, value in answer.items() if key != "log"}
    kept["log"] = {k: v for k, v in answer["log"].items() if k not in ("name", "sha256")}
    return kept


def test_a_fit_is_that_of_the_program(power_on: Path, fitted: gyroid.Fit) -> None:
    expected = answer("fit", power_on, "--base", DATA / "robot.toml")
    assert fitted.to_dict() == expected
    for name in ("c1_rad_s", "c2_rad_s", "time_constant_s"):
        found, wanted = getattr(fitted, name), expected["parameters"][name]
        assert (float(found), found.std, list(found.ci95)) == (wanted["estimate"], wanted["std"], wanted["ci95"])
    assert fitted.fit_for_use and fitted.verdict == "fit_for_use"
    assert "C1" in str(fitted) and "power_on.csv" in str(fitted)


def test_arrays_and_frames_give_what_their_file_gives(power_on: Path) -> None:
    expected = without_file(answer("fit", power_on))
    table = pd.read_csv(power_on)
    t_s, rate_rad_s = table["t_s"].to_numpy(), table["gyro_z_rad_s"].to_numpy()
    frame = pl.read_csv(power_on)
    parts = pl.concat([frame[:7000], frame[7000:]], rechunk=False)
    assert parts.n_chunks() > 1
    fits = {
        "arrays": gyroid.fit(t_s, rate_rad_s),
        "lists": gyroid.fit(t_s.tolist(), rate_rad_s.tolist()),
        "strides": gyroid.fit(np.stack([t_s, t_s], axis=1)[:, 0], np.repeat(rate_rad_s, 2)[::2]),
        "mapping": gyroid.fit({"t_s": t_s, "gyro_z_rad_s": rate_rad_s}),
        "pandas": gyroid.fit(table),
        "polars": gyroid.fit(frame),
        "chunks": gyroid.fit(parts),
        "pyarrow": gyroid.fit(frame.to_arrow()),
        "recording": gyroid.fit(gyroid.read(power_on)),
    }
    hashes = {fit.log.sha256 for fit in fits.values()}
    assert len(hashes) == 1 and len(hashes.pop()) == 64
    for name, fit in fits.items():
        found = without_file(fit.to_dict())
        # decimals of text are known to the last one, those of arrays are not
        assert found["parameters"] == expected["parameters"], name
        assert found["validation"] == expected["validation"], name
        assert found["samples"] == expected["samples"], name


def test_missing_cells_dates_and_integers_are_read(power_on: Path) -> None:
    frame = pl.read_csv(power_on).with_columns(
        pl.from_epoch((pl.col("t_s") * 1e9 + 1.7e18).cast(pl.Int64), time_unit="ns").alias("time"),
        (pl.col("gyro_z_rad_s") * 1e6).round().cast(pl.Int32).alias("gz_raw"),
    )
    holes = frame.with_columns(pl.when(pl.col("t_s") == 100.0).then(None).otherwise("gyro_z_rad_s").alias("gyro_z_rad_s"))
    fit = gyroid.fit(holes.select("time", "gyro_z_rad_s"), start_offset_s=0.0)
    assert fit.log.audit.missing.count == 1
    whole = gyroid.fit(frame.select("time", "gyro_z_rad_s"), start_offset_s=0.0)
    assert whole.samples == frame.height and fit.samples == frame.height - 1
    assert abs(float(whole.time_constant_s) / 241.1 - 1) < 1e-3
    raw = gyroid.fit(frame.select("t_s", "gz_raw"), column="gz_raw", scale={"gz_raw": "1e-6:rad/s"})
    assert abs(float(raw.time_constant_s) / 241.1 - 1) < 1e-2
    read = gyroid.read(holes.select("t_s", "gyro_z_rad_s"))
    assert np.isnan(read["gyro_z_rad_s"]).sum() == 1 and read.t_s.dtype == np.float64


def test_a_temperature_stands_beside_the_rate() -> None:
    rng = np.random.default_rng(3)
    t_s = np.arange(0.0, 1800.0, 0.5)
    temperature_c = 40 - 15 * np.exp(-t_s / 300)
    rate_rad_s = 2e-5 * temperature_c + 2e-4 * rng.normal(size=t_s.size)
    fit = gyroid.fit(t_s, rate_rad_s, temperature_c, against="temperature")
    assert fit.temperature is not None and fit.against == "temperature"
    low, high = fit.to_dict()["temperature"]["parameters"]["sensitivity_rad_s_k"]["ci95"]
    assert low < 2e-5 < high


def test_noise_is_that_of_the_program(power_on: Path, fitted: gyroid.Fit) -> None:
    noise = gyroid.noise(power_on, terms=["N", "K"], write=fitted.config(), horizon_s=300)
    expected = answer("noise", power_on, "--terms", "N,K", "--horizon", "300s")
    found = noise.to_dict()
    assert found.pop("configuration") == "gyroid.toml" and expected.pop("configuration") is None
    assert found == expected
    allan = noise.deviations.overlapping_allan
    assert allan.tau_s.shape == allan.deviation_rad_s.shape == (len(allan),)
    assert allan[0].tau_s == allan.tau_s[0] and allan.ci95.shape == (len(allan), 2)
    term = noise.term("angle_random_walk")
    assert term is not None and float(term) == expected["terms"][0]["estimate"]
    assert noise.config().to_dict()["gyro"]["noise"]


def test_a_check_is_that_of_the_program(tmp_path: Path, power_on: Path, fitted: gyroid.Fit) -> None:
    fitted.config().save(tmp_path / "gyroid.toml")
    expected = answer("validate", tmp_path / "gyroid.toml", power_on)
    assert gyroid.validate(fitted.config(), power_on).to_dict() == expected
    off = gyroid.validate(tmp_path / "gyroid.toml", DATA / "cats_coldsoak_a.csv")
    assert not off.fit_for_use and not off.explained


def test_a_drive_is_that_of_the_program(tmp_path: Path, fitted: gyroid.Fit) -> None:
    drive, config = DATA / "drive.parquet", tmp_path / "gyroid.toml"
    fitted.config().save(config)
    expected = answer("navigate", config, drive, "-o", tmp_path / "pose.parquet")
    found = gyroid.navigate(fitted.config(), drive)
    assert found.to_dict() == expected and found.fit_for_use
    pose = gyroid.read(tmp_path / "pose.parquet")
    assert set(pose) == set(found.pose)
    for channel, values in found.pose.items():
        np.testing.assert_array_equal(values, pose[channel])
    frame = pl.read_parquet(drive)
    assert gyroid.navigate(config, frame).to_dict()["with_error_model"] == expected["with_error_model"]
    with pytest.raises(gyroid.Error, match="save_config=True"):
        found.config()
    after = gyroid.navigate(config, drive, save_config=True).config()
    assert after.to_dict()["gyro"]["last_run"]["warm_up_age_s"] > 0


def test_a_simulation_is_that_of_the_program(tmp_path: Path, fitted: gyroid.Fit) -> None:
    config = tmp_path / "gyroid.toml"
    fitted.config().save(config)
    options = ("--course", "square", "--duration", 20, "--seed", 5, "-o", tmp_path / "drive.parquet")
    answer("simulate", config, *options, "--truth", tmp_path / "truth.parquet")
    found = gyroid.simulate(config, course="square", duration_s=20, seed=5)
    for recording, file in ((found.recording, "drive.parquet"), (found.truth, "truth.parquet")):
        assert recording is not None
        of_file = pl.read_parquet(tmp_path / file)
        assert list(recording) == of_file.columns
        for channel in recording:
            np.testing.assert_array_equal(recording[channel], of_file[channel].fill_null(np.nan).to_numpy())
    again = gyroid.simulate(config, inputs=found.recording, seed=6)
    assert again.truth is not None and len(again.recording.t_s) == len(found.recording.t_s)
    rest = gyroid.simulate(config, duration_s=20)
    assert rest.truth is None and list(rest.recording) == ["t_s", "gyro_z_rad_s"]
    rest.recording.save(tmp_path / "rest.csv")
    np.testing.assert_array_equal(gyroid.read(tmp_path / "rest.csv")["gyro_z_rad_s"], rest.recording["gyro_z_rad_s"])


def test_a_gap_at_rest_is_found_and_told_as_by_the_program(tmp_path: Path) -> None:
    simulator = gyroid.Configuration(
        'schema = 1\nkind = "stationary"\nsample_time_s = 0.1\n[gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\n'
        "time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\n"
    )
    recording = dict(gyroid.simulate(simulator, duration_s=600, seed=4).recording)
    t_s = recording["t_s"]
    recording["gyro_z_rad_s"] = recording["gyro_z_rad_s"] + 1e-3 * np.sin(2 * np.pi * 1.3 * t_s)
    found = gyroid.diagnose(simulator, recording)
    assert (found.verdict, found.main) == ("identified", "gyro.tone")
    assert "[[effect]]" in found.config().text and found.why.startswith("#")
    assert found.effects[0].id == "gyro.tone" and found.effects.probability.shape == (len(found.effects),)
    assert all(curve.x.shape == curve.recorded.shape for curve in found.curves) and len(found.curves) > 0
    simulator.save(tmp_path / "sim.toml")
    pl.DataFrame(recording).write_parquet(tmp_path / "log.parquet")
    expected = answer("gap", "diagnose", tmp_path / "sim.toml", "--fit", tmp_path / "log.parquet")
    assert found.to_dict()["effects"] == expected["effects"]
    told = gyroid.explain(simulator, recording, "gyro.tone")
    assert told.to_dict() == answer(
        "gap", "explain", tmp_path / "sim.toml", "--fit", tmp_path / "log.parquet", "--effect", "gyro.tone"
    )
    without = gyroid.diagnose(simulator, recording, without=["gyro.tone"])
    assert without.main != "gyro.tone"


def test_plan_and_power_are_those_of_the_program(tmp_path: Path) -> None:
    simulator = gyroid.Configuration(
        'schema = 1\nkind = "stationary"\nsample_time_s = 1.0\n[gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\n'
        "time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 5e-3\n"
    )
    recording = dict(gyroid.simulate(simulator, duration_s=600, seed=4).recording)
    recording["gyro_z_rad_s"] = recording["gyro_z_rad_s"] + 1e-7 * recording["t_s"]
    simulator.save(tmp_path / "sim.toml")
    pl.DataFrame(recording).write_parquet(tmp_path / "log.parquet")
    rivals = ["gyro.rate_ramp", "gyro.rate_random_walk"]
    planned = gyroid.plan(simulator, recording, among=rivals, experiment=["rest_longer"])
    expected = answer(
        "gap", "plan", tmp_path / "sim.toml", "--fit", tmp_path / "log.parquet", "--among", *rivals, "--experiment", "rest_longer"
    )
    assert planned.to_dict() == expected
    first = planned.experiments[0]
    assert (planned.inputs is not None) == first.separates
    found = gyroid.diagnose(simulator, recording)
    if any(len(of) > 1 for of in found.to_dict()["cannot_tell_apart"]):
        assert gyroid.plan(simulator, recording, answer=found, experiment=["rest_longer"]).rivals
    power = gyroid.power(simulator, recording, effect=["gyro.tone"], cases=3)
    assert power.to_dict() == answer(
        "gap", "power", tmp_path / "sim.toml", "--inputs", tmp_path / "log.parquet", "--effect", "gyro.tone", "--cases", "3"
    )
    assert power.plot()._repr_svg_().startswith("<")


def test_exports_and_inspections_are_those_of_the_program(tmp_path: Path, fitted: gyroid.Fit) -> None:
    config = tmp_path / "gyroid.toml"
    fitted.config().save(config)
    answer("export", config, "--to", "kalibr", "-o", tmp_path / "imu.yaml")
    made = gyroid.export(config, "kalibr")
    numbers = [line for line in (made.content or "").splitlines() if not line.lstrip().startswith("#")]
    wanted = [line for line in (tmp_path / "imu.yaml").read_text().splitlines() if not line.lstrip().startswith("#")]
    assert numbers == wanted and made.written is True
    made.save(tmp_path / "copy.yaml")
    assert (tmp_path / "copy.yaml").read_text() == made.content
    drive = DATA / "drive.parquet"
    assert gyroid.inspect(drive).to_dict() == answer("inspect", drive)


def test_a_recording_has_every_channel_in_si() -> None:
    recording = gyroid.read(DATA / "drive.parquet")
    frame = pl.read_parquet(DATA / "drive.parquet")
    assert set(recording) >= {"t_s", "gyro_z_rad_s", "wheel_left_rad_s"}
    np.testing.assert_array_equal(recording["wheel_left_rad_s"], frame["wheel_left_rad_s"].to_numpy())
    degrees = {"t_s": frame["t_s"].to_numpy(), "wz_deg_s": np.degrees(frame["gyro_z_rad_s"].to_numpy())}
    np.testing.assert_allclose(gyroid.read(degrees)["gyro_z_rad_s"], frame["gyro_z_rad_s"].to_numpy())
    assert pl.DataFrame(recording.to_dict()).height == frame.height
    assert gyroid.read(DATA / "drive.parquet", map={"gyro_z_rad_s": "-gyro_z_rad_s"})["gyro_z_rad_s"][5] == -recording["gyro_z_rad_s"][5]


def test_several_files_are_one_drive(tmp_path: Path, fitted: gyroid.Fit) -> None:
    frame = pl.read_parquet(DATA / "drive.parquet")
    gyro, rest = frame.select("t_s", "gyro_z_rad_s"), frame.drop("gyro_z_rad_s")
    rest.write_parquet(tmp_path / "wheels.parquet")
    whole = gyroid.navigate(fitted.config(), frame)
    apart = gyroid.navigate(fitted.config(), (gyro, tmp_path / "wheels.parquet"))
    assert apart.to_dict()["with_error_model"] == whole.to_dict()["with_error_model"]


def test_what_is_not_fit_for_use_is_returned_with_a_flag() -> None:
    rng = np.random.default_rng(2)
    t_s = np.arange(0.0, 600.0, 0.1)
    fit = gyroid.fit(t_s, 1e-3 + 1e-4 * rng.normal(size=t_s.size))
    assert not fit.fit_for_use and fit.verdict in ("no_warm_up", "not_identifiable")
    with pytest.raises(gyroid.Error, match="accept=True") as caught:
        fit.config()
    assert caught.value.kind == "unfit"
    drifting = gyroid.fit(t_s, 1e-3 * (1 - np.exp(-t_s / 100)) + 1e-4 * np.sin(t_s) + 1e-4 * rng.normal(size=t_s.size))
    assert not drifting.fit_for_use and not drifting.white
    assert drifting.config(accept=True).to_dict()["gyro"]["time_constant_s"] == float(drifting.time_constant_s)


def test_the_model_is_a_function_of_time(fitted: gyroid.Fit) -> None:
    c1, c2, t = map(float, (fitted.c1_rad_s, fitted.c2_rad_s, fitted.time_constant_s))
    np.testing.assert_allclose(fitted.error_rad_s([0.0, t, 1e9]), [c2, c2 + c1 * (1 - np.exp(-1)), c1 + c2])
    recording = gyroid.read(DATA / "power_on.csv")
    left = recording["gyro_z_rad_s"] - fitted.error_rad_s(recording.t_s)
    assert abs(left.std() / fitted.residual_std_rad_s - 1) < 1e-3


def test_answers_are_shown_and_drawn(tmp_path: Path, fitted: gyroid.Fit) -> None:
    page = fitted._repr_html_()
    assert "time_constant_s" in page and page.count("data:image/svg+xml") == 1 and "<script" not in page
    fitted.plot().save(tmp_path / "fit.svg")
    assert (tmp_path / "fit.svg").read_text().startswith("<svg") and fitted.plot()._repr_svg_().endswith("</svg>\n")
    drive = gyroid.navigate(fitted.config(), DATA / "drive.parquet")
    assert "<svg" in drive.plot().svg and "Navigation(" in repr(drive)
    assert "<table>" in drive.pose._repr_html_() and "Recording('pose'" in repr(drive.pose)
    with pytest.raises(TypeError, match="no picture"):
        gyroid.inspect(DATA / "power_on.csv").plot()


def test_answers_are_kept_and_not_changed(fitted: gyroid.Fit) -> None:
    copy = pickle.loads(pickle.dumps(fitted))
    assert copy == fitted and copy.fit_for_use and copy.plot().svg == fitted.plot().svg
    assert copy.config() == fitted.config()
    with pytest.raises(AttributeError, match="to_dict"):
        fitted.white = False  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        fitted.parameters.c1_rad_s.ci95[0] = 0.0  # type: ignore[index]
    with pytest.raises(AttributeError, match="there are schema"):
        _ = fitted.no_such_key
    assert "parameters" in dir(fitted)


def test_the_configuration_tells_the_call(fitted: gyroid.Fit) -> None:
    provenance = fitted.config().to_dict()["provenance"]
    assert provenance["command"].startswith("gyroid.fit(") and "base=" in provenance["command"]
    assert "memory:" not in fitted.config().text


def test_the_version_is_that_of_the_program() -> None:
    manifest = (ROOT / "Cargo.toml").read_text()
    assert f'\nversion = "{gyroid.__version__}"' in manifest


@pytest.mark.parametrize("page", ["docs/src/python.md", "python/README.md"])
def test_the_code_of_the_pages_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").symlink_to(DATA)
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(), re.M | re.S)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(block, names)
    assert blocks and names["f"].fit_for_use
