"""Types of answers on logs at rest, as the JSON has them. Written by shapes.py: do not edit."""

from __future__ import annotations

from typing import Any

from gyroid._record import Array
from gyroid._record import Estimate
from gyroid._record import Record
from gyroid._record import Rows


class _FitParameters(Record):
    c1_rad_s: Estimate
    c2_rad_s: Estimate
    time_constant_s: Estimate


class _FitEarth(Record):
    latitude_deg: float
    earth_rate_rad_s: float
    bias_rad_s: Estimate


class _FitTermination(Record):
    reason: str
    iterations: int | None
    polish_steps: int | None
    last_step: float | None


class _FitOtherWeighting(Record):
    weighting: str
    parameters: dict[str, Estimate]
    identifiable: bool
    disagrees: bool


class _FitNoise(Record):
    angle_random_walk_rad_sqrt_s: float
    rate_random_walk_probability: float
    rate_random_walk_rad_s_sqrt_s: float
    rate_random_walk_upper95_rad_s_sqrt_s: float


class _FitColour(Estimate):
    id: str
    unit: str
    low_pass_form: str | None
    center_hz: Estimate | None
    bandwidth_hz: Estimate | None
    band_form: str | None


class _FitComparisonConstant(Record):
    parameters: int
    aicc: float | None
    aicc_above_best: float | None


class _FitComparisonAgainstConstant(Record):
    f: float
    p_value: float


class _FitComparison(Record):
    constant: _FitComparisonConstant
    line: _FitComparisonConstant
    warm_up: _FitComparisonConstant
    against_constant: _FitComparisonAgainstConstant
    against_line: _FitComparisonAgainstConstant


class _FitStraightLine(Record):
    start_rad_s: Estimate
    slope_rad_s2: Estimate


class _FitAdvice(Record):
    if_time_constant_s: float
    length_s: float | None
    longer_by_s: float | None
    power_ons: int
    length_each_s: float


class _FitValidationLevelsLagsOutside(Record):
    statistic: float
    p_value: float


class _FitValidationLevelsCalibratedPValues(Record):
    lags_outside_bounds: float
    ljung_box: float
    cumulative_periodogram: float
    runs: float


class _FitValidationLevels(Record):
    averaging_time_s: float
    block_samples: int
    samples: int
    autocorrelation: Array
    autocorrelation_bound: float
    lags_outside: _FitValidationLevelsLagsOutside
    ljung_box: _FitValidationLevelsLagsOutside
    cumulative_periodogram: _FitValidationLevelsLagsOutside
    runs: _FitValidationLevelsLagsOutside
    calibrated_p_values: _FitValidationLevelsCalibratedPValues


class _FitValidation(Record):
    joint_p_value: float | None
    level: float
    draws: int
    seed: int
    levels: Rows[_FitValidationLevels]


class _FitTemperatureExplanationExplanations(Record):
    explanation: str
    ln_evidence_below_best: float
    probability: float


class _FitTemperatureExplanation(Record):
    decided: str | None
    explanations: Rows[_FitTemperatureExplanationExplanations]
    temperature_range_c: float
    correlation: float


class _FitTemperature(Record):
    explanation: _FitTemperatureExplanation | None
    reference_c: float
    parameters: dict[str, Estimate | None]
    covariance_si: Array
    found: bool
    p_value: float
    curvature_p_value: float
    range_c: Array
    temperature_noise_c: float
    attenuation: float
    residual_std_rad_s: float
    noise: _FitNoise


class _FitLogAuditSampling(Record):
    rate_hz: float
    median_step_s: float
    step_std_s: float
    step_p01_s: float
    step_p99_s: float
    uniform: bool


class _FitLogAuditGaps(Record):
    count: int
    missing_s: float
    longest_s: float
    longest_at_s: float | None
    handling: str


class _FitLogAuditDuplicates(Record):
    count: int
    first_row: Any
    handling: str


class _FitLogAuditOutOfOrder(Record):
    count: int
    handling: str


class _FitLogAuditMissing(Record):
    count: int
    first_row: int | None
    handling: str


class _FitLogAuditSaturation(Record):
    samples: int
    limit_rad_s: float | None
    first_at_s: float | None
    handling: str


class _FitLogAuditStuck(Record):
    runs: int
    samples: int
    longest_s: float
    longest_at_s: float | None
    threshold_samples: int
    repeated_fraction: float
    handling: str


class _FitLogAuditRest(Record):
    median_rad_s: float
    noise_std_rad_s: float
    drift_rad_s: float
    lattice_step_rad_s: float | None


class _FitLogAuditMotionIntervals(Record):
    start_s: float
    end_s: float


class _FitLogAuditMotion(Record):
    assessed: bool
    window_s: float
    intervals: Rows[_FitLogAuditMotionIntervals]
    total_s: float
    samples: int


class _FitLogAudit(Record):
    rows: int
    samples: int
    start_s: float
    span_s: float
    sampling: _FitLogAuditSampling
    gaps: _FitLogAuditGaps
    duplicates: _FitLogAuditDuplicates
    out_of_order: _FitLogAuditOutOfOrder
    missing: _FitLogAuditMissing
    saturation: _FitLogAuditSaturation
    stuck: _FitLogAuditStuck
    rest: _FitLogAuditRest
    motion: _FitLogAuditMotion


class _FitLog(Record):
    name: str
    column: str
    unit: str
    sha256: str
    temperature_c: Array | None
    notes: tuple[str, ...]
    audit: _FitLogAudit


class Fit(Record):
    schema: str
    verdict: str
    verdict_text: str
    parameters: _FitParameters
    earth: _FitEarth | None
    correlation: Array
    covariance_si: Array
    identifiable: bool
    warm_up_found: bool
    white: bool
    termination: _FitTermination
    loss: str
    weighting: str
    other_weighting: _FitOtherWeighting | None
    samples: int
    sample_rate_hz: float
    first_s: float
    span_s: float
    residual_std_rad_s: float
    residual_sum_of_squares_rad2_s2: float
    degrees_of_freedom: float
    noise: _FitNoise
    colour: Rows[_FitColour]
    comparison: _FitComparison
    straight_line: _FitStraightLine | None
    advice: Rows[_FitAdvice]
    validation: _FitValidation
    against: str
    temperature: _FitTemperature | None
    log: _FitLog


class _NoiseTermsDatasheetUnits(Record):
    unit: str
    estimate: float
    ci95: Array


class _NoiseTermsAdvice(Record):
    if_size: float
    wanted_relative: float
    length_s: float | None
    longer_by_s: float | None


class _NoiseTerms(Estimate):
    id: str
    unit: str
    symbol: str
    datasheet_units: Rows[_NoiseTermsDatasheetUnits]
    deg_s_sqrt_hz: float | None
    advice: _NoiseTermsAdvice | None
    low_pass_form: str | None
    correlation_time_s: Estimate | None
    drive_rad_s_sqrt_s: float | None
    center_hz: Estimate | None
    bandwidth_hz: Estimate | None
    band_form: str | None


class _NoiseRefused(Record):
    id: str
    probability: float
    upper95: float | None
    unit: str
    advice: _NoiseTermsAdvice | None


class _NoiseSelection(Record):
    terms: tuple[str, ...]
    ln_evidence_below_best: float
    probability: float
    bic_above_best: float


class _NoiseGoodnessBands(Record):
    from_hz: float
    to_hz: float
    coefficients: float
    ratio: float


class _NoiseGoodness(Record):
    p_value: float
    draws: int
    deviance: float
    bands: Rows[_NoiseGoodnessBands]
    not_judged_hz: Array


class _NoiseWaveletMomentsTerms(Estimate):
    id: str
    unit: str
    correlation_time_s: Estimate | None


class _NoiseWaveletMoments(Record):
    terms: Rows[_NoiseWaveletMomentsTerms]
    moments: int
    criterion: float
    p_value: float


class _NoiseDeviationsOverlappingAllan(Record):
    samples: int
    tau_s: float
    deviation_rad_s: float
    ci95: Array
    degrees_of_freedom: float
    noise_exponent: int


class _NoiseDeviations(Record):
    overlapping_allan: Rows[_NoiseDeviationsOverlappingAllan]
    modified_allan: Rows[_NoiseDeviationsOverlappingAllan]
    overlapping_hadamard: Rows[_NoiseDeviationsOverlappingAllan]
    total: Rows[_NoiseDeviationsOverlappingAllan]


class _NoiseWarmUpInfluence(Record):
    removed: bool
    found: bool
    rate_random_walk_removed: float
    removed_is_upper_bound: bool
    rate_random_walk_left_in: float


class _NoiseLedgerEntries(Record):
    id: str
    cause: str
    heading_std_rad: float | None
    share: float
    counted: bool


class _NoiseLedger(Record):
    horizon_s: float
    entries: Rows[_NoiseLedgerEntries]
    heading_std_rad: float
    noise_density_rad_s_sqrt_hz: float
    factor: float
    noise_density_with_bias_state_rad_s_sqrt_hz: float


class _NoiseDatasheetCompared(Record):
    id: str
    name: str
    stated: float
    measured: float
    ci95: Array
    ratio: float
    unit: str


class _NoiseDatasheet(Record):
    name: str
    source: str
    compared: Rows[_NoiseDatasheetCompared]


class Noise(Record):
    schema: str
    verdict: str
    verdict_text: str
    terms: Rows[_NoiseTerms]
    correlation: Array
    refused: Rows[_NoiseRefused]
    selection: Rows[_NoiseSelection]
    goodness: _NoiseGoodness
    wavelet_moments: _NoiseWaveletMoments | None
    deviations: _NoiseDeviations
    allan_with_warm_up: Rows[_NoiseDeviationsOverlappingAllan]
    warm_up: _FitParameters | None
    warm_up_influence: _NoiseWarmUpInfluence
    temperature: _FitTemperatureExplanation | None
    ledger: _NoiseLedger
    datasheet: _NoiseDatasheet | None
    lines: tuple[Any, ...]
    samples: int
    filled_samples: int
    sample_rate_hz: float
    span_s: float
    log: _FitLog
    configuration: str | None


class Validate(Record):
    schema: str
    explained: bool
    white: bool
    signed: bool
    samples: int
    offset_rad_s: float
    offset_expected_std_rad_s: float
    turn_on_stated: bool
    residual_std_rad_s: float
    expected_std_rad_s: float
    against: str
    inside_valid_time: bool | None
    inside_valid_temperature: bool | None
    validation: _FitValidation
    log: _FitLog
