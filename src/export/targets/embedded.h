// Error of the gyro, rad/s, at the next sample.
typedef struct {
    double error_rad_s;
} gyro_bias;

// After a cold power-on.
static inline gyro_bias gyro_bias_cold(void) {
    gyro_bias bias = {GYRO_BIAS_INITIAL_RAD_S};
    return bias;
}

// After a power-on that finds the gyro with this error, rad/s.
static inline gyro_bias gyro_bias_at(double error_rad_s) {
    gyro_bias bias = {error_rad_s};
    return bias;
}

// The rate of the next sample without the error, rad/s.
static inline double gyro_bias_correct(gyro_bias *bias, double rate_rad_s) {
    double corrected = rate_rad_s - bias->error_rad_s;
    // two statements: a product is not fused with the sum where contraction is by expression (-ffp-contract=on)
    double decayed = GYRO_BIAS_DECAY * bias->error_rad_s;
    bias->error_rad_s = decayed + GYRO_BIAS_DRIVE_RAD_S;
    return corrected;
}

// Samples that were missed.
static inline void gyro_bias_skip(gyro_bias *bias, unsigned long samples) {
    double left = bias->error_rad_s - GYRO_BIAS_WARM_RAD_S;
    double decay = GYRO_BIAS_DECAY;
    for (; samples > 0; samples /= 2) {
        if (samples % 2 == 1) {
            left *= decay;
        }
        decay *= decay;
    }
    bias->error_rad_s = GYRO_BIAS_WARM_RAD_S + left;
}

#endif
