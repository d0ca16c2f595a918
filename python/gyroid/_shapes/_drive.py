"""Types of answers on drives and gaps, as the JSON has them. Written by shapes.py: do not edit."""

from __future__ import annotations

from typing import Any

from gyroid._record import Array
from gyroid._record import Estimate
from gyroid._record import Record
from gyroid._record import Rows


class _NavigateSmoothedReferenceAlignment(Record):
    rotation_rad: float
    x_m: float
    y_m: float
    path_share: float
    path_m: float
    until_s: float
    samples: int
    rms_m: float


class _NavigateSmoothedReference(Record):
    samples: int
    position_rms_m: float
    position_end_m: float
    heading_rms_rad: float | None
    heading_end_rad: float | None
    nees_mean: float | None
    nees_end: float | None
    nees_end_bounds95: Array | None
    heading_nees_end: float | None
    alignment: _NavigateSmoothedReferenceAlignment | None


class _NavigateSmoothed(Record):
    reference: _NavigateSmoothedReference | None


class _NavigateWithErrorModelConsistencySensors(Record):
    sensor: str
    readings: int
    nis_mean: float
    nis_mean_bounds95: Array
    nis_effective_readings: float
    nis_mean_bounds999: Array
    fit_for_use: bool
    inside95: float
    mean: float
    mean_bound95: float
    lag1_autocorrelation: float
    lag1_bound95: float


class _NavigateWithErrorModelConsistency(Record):
    readings: int
    gated: int
    nis_mean: float
    nis_mean_bounds95: Array
    nis_holds: bool
    unbiased: bool
    white: bool
    fit_for_use: bool
    rows_inside95: float
    sensors: Rows[_NavigateWithErrorModelConsistencySensors]


class _NavigateWithErrorModelFinalPose(Record):
    x_m: Estimate
    y_m: Estimate
    heading_rad: Estimate
    gyro_error_rad_s: Estimate


class _NavigateWithErrorModel(Record):
    rows: int
    span_s: float
    since_power_on_s: float
    since_power_on_assumed: bool
    warm_up_age_end_s: float
    slip_modelled: bool
    torques_used: bool
    consistency: _NavigateWithErrorModelConsistency
    final_pose: _NavigateWithErrorModelFinalPose
    reference: _NavigateSmoothedReference | None
    notes: tuple[str, ...]
    acceleration_densities: Array | None


class _NavigateZeroedAtStartGyroReckoningReference(Record):
    samples: int
    position_rms_m: float
    position_end_m: float
    heading_rms_rad: float | None
    heading_end_rad: float | None
    alignment: _NavigateSmoothedReferenceAlignment | None


class _NavigateZeroedAtStartGyroReckoning(Record):
    reference: _NavigateZeroedAtStartGyroReckoningReference | None


class _NavigateZeroedAtStart(Record):
    zero_rad_s: float
    rest_s: float
    filter: _NavigateWithErrorModel
    gyro_reckoning: _NavigateZeroedAtStartGyroReckoning


class Navigate(Record):
    schema: str
    fit_for_use: bool
    smoothed: _NavigateSmoothed
    with_error_model: _NavigateWithErrorModel
    without_error_model: _NavigateWithErrorModel
    zeroed_at_start: _NavigateZeroedAtStart | None
    without_effects: Any
    dead_reckoning: _NavigateZeroedAtStartGyroReckoning
    gyro_reckoning: _NavigateZeroedAtStartGyroReckoning
    log_notes: tuple[str, ...]


class _SimulateGyro(Record):
    c1_rad_s: float
    c2_rad_s: float
    time_constant_s: float
    warm_up_age_at_power_on_s: float


class Simulate(Record):
    schema: str
    log: str
    motion: str
    rows: int
    span_s: float
    sample_time_s: float
    seed: int
    sensor_seed: int
    channels: tuple[str, ...]
    gyro: _SimulateGyro | None
    load_kg: float | None


class _GapDiagnoseEffects(Record):
    id: str
    probability: float
    evidence_nats: float | None
    idle: bool
    parameters: dict[str, float]
    std: dict[str, float]
    gap_closed: float | None
    gap_closed_ci95: Array | None
    share: float | None


class _GapDiagnoseRemainderWhere(Record):
    channel: str
    equation: str
    time_s: Any
    frequency_hz: Any
    condition: str | None
    description: str


class _GapDiagnoseRemainder(Record):
    share: float
    where: _GapDiagnoseRemainderWhere | None


class _GapDiagnoseTimeOffsets(Record):
    channel: str
    recording: str
    offset_s: float
    std_s: float


class _GapDiagnoseWhere(Record):
    channel: str
    equation: str
    time_s: Any
    frequency_hz: Array | None
    condition: str | None
    description: str | None


class _GapDiagnoseFreeForms(Record):
    id: str
    probability: float
    share_nats: float
    description: str


class _GapDiagnoseEquationsCorrectionRegressors(Record):
    name: str
    share: float


class _GapDiagnoseEquationsCorrectionAgainst(Record):
    name: str
    unit: str
    values: Array


class _GapDiagnoseEquationsCorrection(Record):
    diffusion: float
    unit: str
    gain_nats: float
    p_value: float
    about_mean: bool
    degrees_of_freedom: float
    times_s: Array
    values: Array
    std: Array
    regressors: Rows[_GapDiagnoseEquationsCorrectionRegressors]
    against: _GapDiagnoseEquationsCorrectionAgainst | None
    starts: Array | None


class _GapDiagnoseEquations(Record):
    equation: str
    channel: str
    gain_nats: float
    follows: str
    correction: _GapDiagnoseEquationsCorrection | None


class _GapDiagnoseGap(Record):
    metric: str
    before: float
    after: float
    floor: float


class _GapDiagnoseNavigationBefore(Record):
    position_rms_m: float
    heading_rms_rad: float
    nis_mean: float
    nis_mean_bounds95: Array


class _GapDiagnoseNavigation(Record):
    before: _GapDiagnoseNavigationBefore
    after: _GapDiagnoseNavigationBefore


class _GapDiagnoseTraceLimit(Record):
    name: str
    value: float
    unit: str


class _GapDiagnoseTrace(Record):
    stage: str
    subject: str
    decision: str
    reason: str
    nats: float | None
    limit: _GapDiagnoseTraceLimit | None


class _GapDiagnoseCurves(Record):
    source: str | None
    over: str
    x_unit: str
    shown: str
    unit: str
    x: Array
    recorded: Array
    before: Array
    after: Array
    begins_s: Array | None
    by_torques: bool | None
    bins: Array | None
    outside_before: float | None
    outside_after: float | None
    excess_before: float | None
    excess_after: float | None
    share: float | None
    most_in: Array | None


class _GapDiagnoseNearest(Record):
    id: str
    share: float
    gap: Rows[_GapDiagnoseGap]


class _GapDiagnoseAlike(Record):
    ids: tuple[str, ...]
    overlap: float
    separate_by: str


class _GapDiagnosePatchLog(Record):
    file: str | None
    effects: tuple[str, ...]


class _GapDiagnosePatch(Record):
    file: str
    changes: tuple[str, ...]
    no_place: tuple[Any, ...]
    notes: tuple[str, ...]
    log: _GapDiagnosePatchLog


class GapDiagnose(Record):
    schema: str
    verdict: str
    main: str | None
    main_probability: float
    none_probability: float
    unknown_probability: float
    effects: Rows[_GapDiagnoseEffects]
    together: tuple[str, ...]
    remainder: _GapDiagnoseRemainder | None
    time_offsets: Rows[_GapDiagnoseTimeOffsets]
    cannot_tell_apart: Array
    where: _GapDiagnoseWhere | None
    free_forms: Rows[_GapDiagnoseFreeForms] | None
    equations: Rows[_GapDiagnoseEquations] | None
    gap: Rows[_GapDiagnoseGap]
    navigation: _GapDiagnoseNavigation | None
    notes: tuple[str, ...]
    trace: Rows[_GapDiagnoseTrace]
    curves: Rows[_GapDiagnoseCurves]
    nearest: _GapDiagnoseNearest | None
    alike: Rows[_GapDiagnoseAlike] | None
    patch: _GapDiagnosePatch | None


class _GapExplainEffects(Record):
    id: str
    gain_nats: float
    parameters: dict[str, Estimate]


class GapExplain(Record):
    schema: str
    effects: Rows[_GapExplainEffects]
    notes: tuple[str, ...]


class _GapCompareEffects(Record):
    id: str
    probability: float
    evidence_nats: float | None
    idle: bool
    parameters: dict[str, float]
    std: dict[str, float]
    gap_closed: float | None
    gap_closed_ci95: Array | None
    share: float


class _GapCompareRemainderWhere(Record):
    channel: str
    equation: str
    time_s: Any
    frequency_hz: Any
    condition: str
    description: str


class _GapCompareRemainder(Record):
    share: float
    where: _GapCompareRemainderWhere


class _GapCompareEquations(Record):
    equation: str
    channel: str
    gain_nats: float
    follows: str


class _GapCompareCurves(Record):
    source: str
    over: str
    x_unit: str
    shown: str
    unit: str
    x: Array
    recorded: Array
    before: Array
    after: Array
    begins_s: Array
    by_torques: bool


class _GapCompareTwinParametersValue(Record):
    value: float
    std: float | None
    ci95: Array | None
    unit: str
    source: str


class _GapCompareTwinFitChannels(Record):
    channel: str
    explained_one_step: float
    nis_mean: float
    nis_mean_bounds95: Array
    lag_one: float
    readings: int


class _GapCompareTwinFit(Record):
    channels: Rows[_GapCompareTwinFitChannels]
    horizons: Rows[_GapDiagnoseGap]
    left: str
    remainder: Any
    free_forms: tuple[Any, ...]


class _GapCompareTwinDifferenceReal(Record):
    value: float
    std: float


class _GapCompareTwinDifference(Record):
    id: str
    parameter: str
    real: _GapCompareTwinDifferenceReal
    simulator: _GapCompareTwinDifferenceReal
    difference: _GapCompareTwinDifferenceReal
    is_gap: bool


class _GapCompareTwinPairs(Record):
    simulator: str
    real: str
    inputs: tuple[str, ...]
    offset_s: float
    correlation: float
    rms: dict[str, float]


class _GapCompareTwin(Record):
    parameters: dict[str, _GapCompareTwinParametersValue]
    fit: _GapCompareTwinFit
    effects: tuple[Any, ...]
    runs: int
    notes: tuple[str, ...]
    difference: Rows[_GapCompareTwinDifference]
    pairs: Rows[_GapCompareTwinPairs]


class GapCompare(Record):
    schema: str
    verdict: str
    main: str
    main_probability: float
    none_probability: float
    unknown_probability: float
    effects: Rows[_GapCompareEffects]
    together: tuple[str, ...]
    remainder: _GapCompareRemainder | None
    time_offsets: Rows[_GapDiagnoseTimeOffsets]
    cannot_tell_apart: Array
    alike: Rows[_GapDiagnoseAlike] | None
    where: _GapDiagnoseWhere
    equations: Rows[_GapCompareEquations] | None
    gap: Rows[_GapDiagnoseGap]
    navigation: _GapDiagnoseNavigation | None
    notes: tuple[str, ...]
    trace: Rows[_GapDiagnoseTrace]
    curves: Rows[_GapCompareCurves]
    twin: _GapCompareTwin
    free_forms: Rows[_GapDiagnoseFreeForms] | None


class _GapPlanRivalsBeside(Record):
    id: str
    parameters: dict[str, float]


class _GapPlanRivals(Record):
    id: str
    parameters: dict[str, float]
    beside: Rows[_GapPlanRivalsBeside]


class _GapPlanExperimentsPairs(Record):
    truth: str
    rival: str
    nats: float
    probability: float


class _GapPlanExperimentsCommands(Record):
    t_s: float
    speed_m_s: float
    yaw_rate_rad_s: float


class _GapPlanExperiments(Record):
    name: str
    how: str
    duration_s: float
    load_kg: float | None
    alone: bool
    separates: bool
    nats: float
    probability: float
    pairs: Rows[_GapPlanExperimentsPairs]
    commands: Rows[_GapPlanExperimentsCommands]


class GapPlan(Record):
    schema: str
    rivals: Rows[_GapPlanRivals]
    resolution_nats: float
    load_kg: float
    experiments: Rows[_GapPlanExperiments]
    needed: str | None
    notes: tuple[str, ...]
    kind: str


class _GapPowerNominal(Record):
    logs: int
    none: int


class _GapPowerEffectsChecked(Record):
    logs: int
    named: int
    share_ci95: Array


class _GapPowerEffectsInstead(Record):
    answer: str
    logs: int


class _GapPowerEffects(Record):
    id: str
    parameter: str
    null: float
    sign: int
    smallest: float | None
    smallest_ci95: Array | None
    parameters: dict[str, float]
    thresholds: Array
    evidence_nats: float | None
    checked: _GapPowerEffectsChecked | None
    instead: Rows[_GapPowerEffectsInstead]


class _GapPowerCannotShow(Record):
    id: str
    reason: str


class GapPower(Record):
    schema: str
    probability: float
    cases: int
    seed: int
    rows: int
    span_s: float
    sample_time_s: float
    nominal: _GapPowerNominal
    effects: Rows[_GapPowerEffects]
    cannot_show: Rows[_GapPowerCannotShow]
    notes: tuple[str, ...]
    kind: str
