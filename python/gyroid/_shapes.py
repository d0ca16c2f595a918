"""Types of the answers, as the JSON has them. Written by shapes.py: do not edit."""

from __future__ import annotations

from typing import Any

from gyroid._record import Array, Estimate, Record, Rows


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
    low_pass_form: str


class _FitComparisonConstant(Record):
    parameters: int
    aicc: float
    aicc_above_best: float


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
    joint_p_value: float
    level: float
    draws: int
    seed: int
    levels: Rows[_FitValidationLevels]


class _FitTemperatureExplanationExplanations(Record):
    explanation: str
    ln_evidence_below_best: float
    probability: float


class _FitTemperatureExplanation(Record):
    decided: Any
    explanations: Rows[_FitTemperatureExplanationExplanations]
    temperature_range_c: float
    correlation: float


class _FitTemperature(Record):
    explanation: _FitTemperatureExplanation
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
    longest_at_s: Any
    handling: str


class _FitLogAuditDuplicates(Record):
    count: int
    first_row: Any
    handling: str


class _FitLogAuditOutOfOrder(Record):
    count: int
    handling: str


class _FitLogAuditSaturation(Record):
    samples: int
    limit_rad_s: Any
    first_at_s: Any
    handling: str


class _FitLogAuditStuck(Record):
    runs: int
    samples: int
    longest_s: float
    longest_at_s: Any
    threshold_samples: int
    repeated_fraction: float
    handling: str


class _FitLogAuditRest(Record):
    median_rad_s: float
    noise_std_rad_s: float
    drift_rad_s: float
    lattice_step_rad_s: float | None


class _FitLogAuditMotion(Record):
    assessed: bool
    window_s: float
    intervals: tuple[Any, ...]
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
    missing: _FitLogAuditDuplicates
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
    length_s: float
    longer_by_s: float


class _NoiseTerms(Estimate):
    id: str
    unit: str
    symbol: str
    datasheet_units: Rows[_NoiseTermsDatasheetUnits]
    deg_s_sqrt_hz: float | None
    advice: _NoiseTermsAdvice | None
    low_pass_form: str | None


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
    not_judged_hz: tuple[Any, ...]


class _NoiseWaveletMomentsTerms(Estimate):
    id: str
    unit: str


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


class _NavigateSmoothedReference(Record):
    samples: int
    position_rms_m: float
    position_end_m: float
    heading_rms_rad: float
    heading_end_rad: float
    nees_mean: float
    nees_end: float
    nees_end_bounds95: Array
    heading_nees_end: float


class _NavigateSmoothed(Record):
    reference: _NavigateSmoothedReference


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
    reference: _NavigateSmoothedReference
    notes: tuple[Any, ...]


class _NavigateDeadReckoningReference(Record):
    samples: int
    position_rms_m: float
    position_end_m: float
    heading_rms_rad: float
    heading_end_rad: float


class _NavigateDeadReckoning(Record):
    reference: _NavigateDeadReckoningReference


class Navigate(Record):
    schema: str
    fit_for_use: bool
    smoothed: _NavigateSmoothed
    with_error_model: _NavigateWithErrorModel
    without_error_model: _NavigateWithErrorModel
    without_effects: Any
    dead_reckoning: _NavigateDeadReckoning
    gyro_reckoning: _NavigateDeadReckoning
    log_notes: tuple[Any, ...]


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


class _GapDiagnoseEffects(Record):
    id: str
    probability: float
    evidence_nats: float | None
    idle: bool
    parameters: dict[str, float]
    std: dict[str, float]
    gap_closed: float | None
    gap_closed_ci95: Array | None
    share: float


class _GapDiagnoseRemainderWhere(Record):
    channel: str
    equation: str
    time_s: Any
    frequency_hz: Any
    condition: str | None
    description: str


class _GapDiagnoseRemainder(Record):
    share: float
    where: _GapDiagnoseRemainderWhere


class _GapDiagnoseTimeOffsets(Record):
    channel: str
    recording: str
    offset_s: float
    std_s: float


class _GapDiagnoseAlike(Record):
    ids: tuple[str, ...]
    overlap: float
    separate_by: str


class _GapDiagnoseWhere(Record):
    channel: str
    equation: str
    time_s: Any
    frequency_hz: Array | None
    condition: Any


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
    against: _GapDiagnoseEquationsCorrectionAgainst


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
    over: str
    x_unit: str
    shown: str
    unit: str
    x: Array
    bins: Array
    recorded: Array
    before: Array
    after: Array
    outside_before: float
    outside_after: float
    excess_before: float
    excess_after: float
    share: float
    most_in: Array | None


class _GapDiagnoseFreeForms(Record):
    id: str
    probability: float
    description: str


class GapDiagnose(Record):
    schema: str
    verdict: str
    main: str
    main_probability: float
    none_probability: float
    unknown_probability: float
    effects: Rows[_GapDiagnoseEffects]
    together: tuple[str, ...]
    remainder: _GapDiagnoseRemainder
    time_offsets: Rows[_GapDiagnoseTimeOffsets]
    cannot_tell_apart: Array
    alike: Rows[_GapDiagnoseAlike] | None
    where: _GapDiagnoseWhere
    equations: Rows[_GapDiagnoseEquations] | None
    gap: Rows[_GapDiagnoseGap]
    navigation: _GapDiagnoseNavigation | None
    notes: tuple[str, ...]
    trace: Rows[_GapDiagnoseTrace]
    curves: Rows[_GapDiagnoseCurves]
    free_forms: Rows[_GapDiagnoseFreeForms] | None


class _GapExplainEffects(Record):
    id: str
    gain_nats: float
    parameters: dict[str, Estimate]


class GapExplain(Record):
    schema: str
    effects: Rows[_GapExplainEffects]
    notes: tuple[str, ...]


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
    first_s: float
    stated: bool


class _InspectTime(Record):
    column: str
    clock: _InspectTimeClock
    start_s: float
    span_s: float
    not_increasing: int
    sampling: _FitLogAuditSampling
    gaps: _FitLogAuditGaps


class _InspectGyroAuditRest(Record):
    median_rad_s: float
    noise_std_rad_s: float
    drift_rad_s: float
    lattice_step_rad_s: Any


class _InspectGyroAuditMotionIntervals(Record):
    start_s: float
    end_s: float


class _InspectGyroAuditMotion(Record):
    assessed: bool
    window_s: float
    intervals: Rows[_InspectGyroAuditMotionIntervals]
    total_s: float
    samples: int


class _InspectGyroAudit(Record):
    rows: int
    samples: int
    start_s: float
    span_s: float
    sampling: _FitLogAuditSampling
    gaps: _FitLogAuditGaps
    duplicates: _FitLogAuditDuplicates
    out_of_order: _FitLogAuditOutOfOrder
    missing: _FitLogAuditDuplicates
    saturation: _FitLogAuditSaturation
    stuck: _FitLogAuditStuck
    rest: _InspectGyroAuditRest
    motion: _InspectGyroAuditMotion


class _InspectGyro(Record):
    axis: str
    column: str
    unit: str
    unit_guessed: bool
    audit: _InspectGyroAudit
    problem: Any


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
