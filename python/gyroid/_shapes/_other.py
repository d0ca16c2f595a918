"""Types of other answers, as the JSON has them. Written by shapes.py: do not edit."""

from __future__ import annotations

from typing import Any

from gyroid._record import Array
from gyroid._record import Estimate
from gyroid._record import Record
from gyroid._record import Rows
from gyroid._shapes._rest import _FitLogAuditGaps
from gyroid._shapes._rest import _FitLogAuditMissing
from gyroid._shapes._rest import _FitLogAuditMotion
from gyroid._shapes._rest import _FitLogAuditOutOfOrder
from gyroid._shapes._rest import _FitLogAuditRest
from gyroid._shapes._rest import _FitLogAuditSampling
from gyroid._shapes._rest import _FitLogAuditSaturation
from gyroid._shapes._rest import _FitLogAuditStuck


class _ExportKeys(Record):
    key: str
    value: float
    unit: str
    meaning: str
    ci95: Array | None


class _ExportLeftOut(Record):
    key: str
    why: str
    hint: str


class _ExportConfiguration(Record):
    file: str
    sha256: str
    signed: bool


class Export(Record):
    schema: str
    target: str
    axis: str
    axis_assumed: bool
    keys: Rows[_ExportKeys]
    left_out: Rows[_ExportLeftOut]
    notes: tuple[str, ...]
    text: str
    configuration: _ExportConfiguration
    written: bool


class _InspectColumns(Record):
    name: str
    type_name: str
    role: str
    unit: str | None
    missing: int
    not_a_number: Any
    min: float
    median: float
    max: float


class _InspectTimeClock(Record):
    counts_from: str
    first_s: float | None
    stated: bool | None
    file_s: float | None


class _InspectTime(Record):
    column: str
    clock: _InspectTimeClock
    start_s: float
    span_s: float
    not_increasing: int
    sampling: _FitLogAuditSampling | None
    gaps: _FitLogAuditGaps | None


class _InspectGyroAudit(Record):
    rows: int
    samples: int
    start_s: float
    span_s: float
    sampling: _FitLogAuditSampling
    gaps: _FitLogAuditGaps
    duplicates: _FitLogAuditMissing
    out_of_order: _FitLogAuditOutOfOrder
    missing: _FitLogAuditMissing
    saturation: _FitLogAuditSaturation
    stuck: _FitLogAuditStuck
    rest: _FitLogAuditRest
    motion: _FitLogAuditMotion


class _InspectGyro(Record):
    axis: str
    column: str
    unit: str | None
    unit_guessed: bool
    audit: _InspectGyroAudit | None
    problem: str | None


class Inspect(Record):
    schema: str
    file: str
    format: str
    sha256: str
    topics: tuple[Any, ...]
    topic: Any
    rows: int
    columns: Rows[_InspectColumns]
    time: _InspectTime
    gyro: Rows[_InspectGyro]
    problems: tuple[Any, ...]
    notes: tuple[str, ...]
    fits: bool


class _StudyTractionLawBurckhardt(Record):
    c1: float
    c2: float
    c3: float


class _StudyTractionLaw(Record):
    burckhardt: _StudyTractionLawBurckhardt


class _StudyTraction(Record):
    low_speed_m_s: float
    driven_load_share: float
    left_load_share: float
    rolling_resistance: float
    law: _StudyTractionLaw


class _StudyRmsValue(Record):
    x_m: float
    y_m: float
    heading_rad: float


class _StudyRmsCi95Value(Record):
    x_m: Array
    y_m: Array
    heading_rad: Array


class _StudyRmsEnd(Record):
    slip: _StudyRmsValue
    rolling: _StudyRmsValue
    slip_without_error_model: _StudyRmsValue
    rolling_without_error_model: _StudyRmsValue
    dead_reckoning: _StudyRmsValue
    gyro_reckoning: _StudyRmsValue
    gyro_reckoning_zeroed: _StudyRmsValue
    gyro_reckoning_modelled: _StudyRmsValue


class _StudyNeesValue(Record):
    mean: float
    expected: int
    bounds95: Array
    inside_bounds: float
    above_bounds: float


class _StudyNisMean(Record):
    slip: float
    rolling: float
    slip_without_error_model: float
    rolling_without_error_model: float


class _StudyFactorsValue(Record):
    factor: _StudyRmsValue
    factor_ci95: _StudyRmsCi95Value
    won: _StudyRmsValue


class _StudyOverTime(Record):
    time_s: Array
    rms: dict[str, _StudyRmsCi95Value]
    nees: dict[str, Array]


class _StudyExampleSlipLeft(Estimate):
    truth: Array


class _StudyExample(Record):
    time_s: Array
    truth: _StudyRmsCi95Value
    estimates: dict[str, _StudyRmsCi95Value]
    slip_left: _StudyExampleSlipLeft
    slip_right: _StudyExampleSlipLeft
    slips_inside_two_std: float


class _StudyIdentificationLevels(Record):
    averaging_time_s: float
    samples: int
    autocorrelation: Array
    autocorrelation_bound: float


class _StudyIdentification(Record):
    log: str
    parameters: dict[str, Estimate]
    white: bool
    joint_p_value: float
    levels: Rows[_StudyIdentificationLevels]


class _StudyConvergenceValue(Record):
    runs: int
    rms: dict[str, float]
    rms_ci95: dict[str, Array]


class _StudyGroundsRmsEnd(Record):
    slip: _StudyRmsValue
    rolling: _StudyRmsValue
    dead_reckoning: _StudyRmsValue


class _StudyGroundsNisMean(Record):
    slip: float
    rolling: float


class _StudyGrounds(Record):
    surface: str
    peak_friction: float
    slip_rms: float
    rms: dict[str, _StudyRmsValue]
    rms_ci95: dict[str, _StudyRmsCi95Value]
    rms_end: _StudyGroundsRmsEnd
    nees: dict[str, _StudyNeesValue]
    nis_mean: _StudyGroundsNisMean
    slip_against_rolling: _StudyFactorsValue


class _StudyWrongBeliefs(Record):
    friction_factor: float
    stiffness_factor: float
    rms: dict[str, float]
    nis_mean: float
    slip_against_rolling: _StudyFactorsValue


class _StudyClaims(Record):
    place: str
    says: str
    status: str
    here: str


class Study(Record):
    schema: str
    runs: int
    seed: int
    duration_s: float
    since_power_on_s: float
    sample_time_s: float
    course: str
    ground: str
    configuration: str
    traction: _StudyTraction
    rms: dict[str, _StudyRmsValue]
    rms_ci95: dict[str, _StudyRmsCi95Value]
    rms_end: _StudyRmsEnd
    nees: dict[str, _StudyNeesValue]
    nis_mean: _StudyNisMean
    won_in_all_three: float
    factors: dict[str, _StudyFactorsValue]
    over_time: _StudyOverTime
    example: _StudyExample
    identification: _StudyIdentification
    convergence: dict[str, Rows[_StudyConvergenceValue]]
    grounds: Rows[_StudyGrounds]
    wrong_beliefs: Rows[_StudyWrongBeliefs]
    claims: Rows[_StudyClaims]
