//! The rolling filter of eight states without a loop. Written by `unroll.py`, which says how: not to be edited.

/// Mean, U column by column without its diagonal, D, and the model's numbers.
#[derive(Clone)]
pub struct Unrolled {
    pub mean: [f64; 8],
    pub u: [f64; 28],
    pub d: [f64; 8],
    pub a_by_torque: f64,
    pub alpha_by_torque: f64,
    pub damping: f64,
    pub yaw_damping: f64,
    pub torque_variance: f64,
    pub walk: f64,
    pub gyro_variance: f64,
    pub wheel_variance: f64,
    pub wheel_by_speed: f64,
}

impl Unrolled {
    /// Takes in a reading of the gyro.
    #[rustfmt::skip]
    pub fn gyro(&mut self, reading: f64) {
        let r = self.gyro_variance; let residual = reading - (self.mean[4] + self.mean[5]); let a = r; let f_4 = 1.0;
        let v_4 = self.d[4] * f_4; let a_4 = a + f_4 * v_4; let f_5 = self.u[14] + 1.0; let v_5 = self.d[5] * f_5;
        let a_5 = a_4 + f_5 * v_5; let f_6 = self.u[19] + self.u[20]; let v_6 = self.d[6] * f_6;
        let a_6 = a_5 + f_6 * v_6; let f_7 = self.u[25] + self.u[26]; let v_7 = self.d[7] * f_7;
        let a_7 = a_6 + f_7 * v_7; let r_4 = 1.0 / a_4; self.d[4] *= a * r_4; let u_0_4 = self.u[6];
        let g_0_4 = v_4 * u_0_4; let u_1_4 = self.u[7]; let g_1_4 = v_4 * u_1_4; let u_2_4 = self.u[8];
        let g_2_4 = v_4 * u_2_4; let u_3_4 = self.u[9]; let g_3_4 = v_4 * u_3_4; let r_5 = 1.0 / a_5;
        self.d[5] *= a_4 * r_5; let l_5 = -f_5 * r_4; let u_0_5 = self.u[10]; self.u[10] = u_0_5 + l_5 * g_0_4;
        let g_0_5 = g_0_4 + v_5 * u_0_5; let u_1_5 = self.u[11]; self.u[11] = u_1_5 + l_5 * g_1_4;
        let g_1_5 = g_1_4 + v_5 * u_1_5; let u_2_5 = self.u[12]; self.u[12] = u_2_5 + l_5 * g_2_4;
        let g_2_5 = g_2_4 + v_5 * u_2_5; let u_3_5 = self.u[13]; self.u[13] = u_3_5 + l_5 * g_3_4;
        let g_3_5 = g_3_4 + v_5 * u_3_5; let u_4_5 = self.u[14]; self.u[14] = u_4_5 + l_5 * v_4;
        let g_4_5 = v_4 + v_5 * u_4_5; let r_6 = 1.0 / a_6; self.d[6] *= a_5 * r_6; let l_6 = -f_6 * r_5;
        let u_0_6 = self.u[15]; self.u[15] = u_0_6 + l_6 * g_0_5; let g_0_6 = g_0_5 + v_6 * u_0_6;
        let u_1_6 = self.u[16]; self.u[16] = u_1_6 + l_6 * g_1_5; let g_1_6 = g_1_5 + v_6 * u_1_6;
        let u_2_6 = self.u[17]; self.u[17] = u_2_6 + l_6 * g_2_5; let g_2_6 = g_2_5 + v_6 * u_2_6;
        let u_3_6 = self.u[18]; self.u[18] = u_3_6 + l_6 * g_3_5; let g_3_6 = g_3_5 + v_6 * u_3_6;
        let u_4_6 = self.u[19]; self.u[19] = u_4_6 + l_6 * g_4_5; let g_4_6 = g_4_5 + v_6 * u_4_6;
        let u_5_6 = self.u[20]; self.u[20] = u_5_6 + l_6 * v_5; let g_5_6 = v_5 + v_6 * u_5_6; let r_7 = 1.0 / a_7;
        self.d[7] *= a_6 * r_7; let l_7 = -f_7 * r_6; let u_0_7 = self.u[21]; self.u[21] = u_0_7 + l_7 * g_0_6;
        let g_0_7 = g_0_6 + v_7 * u_0_7; let u_1_7 = self.u[22]; self.u[22] = u_1_7 + l_7 * g_1_6;
        let g_1_7 = g_1_6 + v_7 * u_1_7; let u_2_7 = self.u[23]; self.u[23] = u_2_7 + l_7 * g_2_6;
        let g_2_7 = g_2_6 + v_7 * u_2_7; let u_3_7 = self.u[24]; self.u[24] = u_3_7 + l_7 * g_3_6;
        let g_3_7 = g_3_6 + v_7 * u_3_7; let u_4_7 = self.u[25]; self.u[25] = u_4_7 + l_7 * g_4_6;
        let g_4_7 = g_4_6 + v_7 * u_4_7; let u_5_7 = self.u[26]; self.u[26] = u_5_7 + l_7 * g_5_6;
        let g_5_7 = g_5_6 + v_7 * u_5_7; let u_6_7 = self.u[27]; self.u[27] = u_6_7 + l_7 * v_6;
        let g_6_7 = v_6 + v_7 * u_6_7; let step = residual * r_7; self.mean[0] += g_0_7 * step;
        self.mean[1] += g_1_7 * step; self.mean[2] += g_2_7 * step; self.mean[3] += g_3_7 * step;
        self.mean[4] += g_4_7 * step; self.mean[5] += g_5_7 * step; self.mean[6] += g_6_7 * step;
        self.mean[7] += v_7 * step;
    }

    /// Takes in a reading of a wheel; `by_yaw_rate` is negative on the left.
    #[rustfmt::skip]
    pub fn wheel(&mut self, reading: f64, by_yaw_rate: f64) {
        let (r, by_speed) = (self.wheel_variance, self.wheel_by_speed);
        let residual = reading - (by_speed * self.mean[3] + by_yaw_rate * self.mean[4]); let a = r; let f_3 = by_speed;
        let v_3 = self.d[3] * f_3; let a_3 = a + f_3 * v_3; let f_4 = by_speed * self.u[9] + by_yaw_rate;
        let v_4 = self.d[4] * f_4; let a_4 = a_3 + f_4 * v_4;
        let f_5 = by_speed * self.u[13] + by_yaw_rate * self.u[14]; let v_5 = self.d[5] * f_5;
        let a_5 = a_4 + f_5 * v_5; let f_6 = by_speed * self.u[18] + by_yaw_rate * self.u[19];
        let v_6 = self.d[6] * f_6; let a_6 = a_5 + f_6 * v_6;
        let f_7 = by_speed * self.u[24] + by_yaw_rate * self.u[25]; let v_7 = self.d[7] * f_7;
        let a_7 = a_6 + f_7 * v_7; let r_3 = 1.0 / a_3; self.d[3] *= a * r_3; let u_0_3 = self.u[3];
        let g_0_3 = v_3 * u_0_3; let u_1_3 = self.u[4]; let g_1_3 = v_3 * u_1_3; let u_2_3 = self.u[5];
        let g_2_3 = v_3 * u_2_3; let r_4 = 1.0 / a_4; self.d[4] *= a_3 * r_4; let l_4 = -f_4 * r_3;
        let u_0_4 = self.u[6]; self.u[6] = u_0_4 + l_4 * g_0_3; let g_0_4 = g_0_3 + v_4 * u_0_4; let u_1_4 = self.u[7];
        self.u[7] = u_1_4 + l_4 * g_1_3; let g_1_4 = g_1_3 + v_4 * u_1_4; let u_2_4 = self.u[8];
        self.u[8] = u_2_4 + l_4 * g_2_3; let g_2_4 = g_2_3 + v_4 * u_2_4; let u_3_4 = self.u[9];
        self.u[9] = u_3_4 + l_4 * v_3; let g_3_4 = v_3 + v_4 * u_3_4; let r_5 = 1.0 / a_5; self.d[5] *= a_4 * r_5;
        let l_5 = -f_5 * r_4; let u_0_5 = self.u[10]; self.u[10] = u_0_5 + l_5 * g_0_4;
        let g_0_5 = g_0_4 + v_5 * u_0_5; let u_1_5 = self.u[11]; self.u[11] = u_1_5 + l_5 * g_1_4;
        let g_1_5 = g_1_4 + v_5 * u_1_5; let u_2_5 = self.u[12]; self.u[12] = u_2_5 + l_5 * g_2_4;
        let g_2_5 = g_2_4 + v_5 * u_2_5; let u_3_5 = self.u[13]; self.u[13] = u_3_5 + l_5 * g_3_4;
        let g_3_5 = g_3_4 + v_5 * u_3_5; let u_4_5 = self.u[14]; self.u[14] = u_4_5 + l_5 * v_4;
        let g_4_5 = v_4 + v_5 * u_4_5; let r_6 = 1.0 / a_6; self.d[6] *= a_5 * r_6; let l_6 = -f_6 * r_5;
        let u_0_6 = self.u[15]; self.u[15] = u_0_6 + l_6 * g_0_5; let g_0_6 = g_0_5 + v_6 * u_0_6;
        let u_1_6 = self.u[16]; self.u[16] = u_1_6 + l_6 * g_1_5; let g_1_6 = g_1_5 + v_6 * u_1_6;
        let u_2_6 = self.u[17]; self.u[17] = u_2_6 + l_6 * g_2_5; let g_2_6 = g_2_5 + v_6 * u_2_6;
        let u_3_6 = self.u[18]; self.u[18] = u_3_6 + l_6 * g_3_5; let g_3_6 = g_3_5 + v_6 * u_3_6;
        let u_4_6 = self.u[19]; self.u[19] = u_4_6 + l_6 * g_4_5; let g_4_6 = g_4_5 + v_6 * u_4_6;
        let u_5_6 = self.u[20]; self.u[20] = u_5_6 + l_6 * v_5; let g_5_6 = v_5 + v_6 * u_5_6; let r_7 = 1.0 / a_7;
        self.d[7] *= a_6 * r_7; let l_7 = -f_7 * r_6; let u_0_7 = self.u[21]; self.u[21] = u_0_7 + l_7 * g_0_6;
        let g_0_7 = g_0_6 + v_7 * u_0_7; let u_1_7 = self.u[22]; self.u[22] = u_1_7 + l_7 * g_1_6;
        let g_1_7 = g_1_6 + v_7 * u_1_7; let u_2_7 = self.u[23]; self.u[23] = u_2_7 + l_7 * g_2_6;
        let g_2_7 = g_2_6 + v_7 * u_2_7; let u_3_7 = self.u[24]; self.u[24] = u_3_7 + l_7 * g_3_6;
        let g_3_7 = g_3_6 + v_7 * u_3_7; let u_4_7 = self.u[25]; self.u[25] = u_4_7 + l_7 * g_4_6;
        let g_4_7 = g_4_6 + v_7 * u_4_7; let u_5_7 = self.u[26]; self.u[26] = u_5_7 + l_7 * g_5_6;
        let g_5_7 = g_5_6 + v_7 * u_5_7; let u_6_7 = self.u[27]; self.u[27] = u_6_7 + l_7 * v_6;
        let g_6_7 = v_6 + v_7 * u_6_7; let step = residual * r_7; self.mean[0] += g_0_7 * step;
        self.mean[1] += g_1_7 * step; self.mean[2] += g_2_7 * step; self.mean[3] += g_3_7 * step;
        self.mean[4] += g_4_7 * step; self.mean[5] += g_5_7 * step; self.mean[6] += g_6_7 * step;
        self.mean[7] += v_7 * step;
    }

    /// A step of `dt` seconds; damping times that must be below 0.001, and the turn below 0.5 rad.
    #[rustfmt::skip]
    pub fn predict(&mut self, torques: [f64; 2], dt: f64) {
        let [x, y, theta, v, w, e, s, ln_t] = self.mean; let a = self.a_by_torque * (torques[0] + torques[1]);
        let alpha = self.alpha_by_torque * (torques[1] - torques[0]); let t_0 = 0.11270166537925831 * dt;
        let t_1 = 0.5 * dt; let t_2 = 0.8872983346207417 * dt; let z = self.damping * t_0;
        let s_0_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let s_0_1 = 1.0 - z * s_0_2; let s_0_0 = 1.0 - z * s_0_1; let z = self.damping * t_1;
        let s_1_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let s_1_1 = 1.0 - z * s_1_2; let s_1_0 = 1.0 - z * s_1_1; let z = self.damping * t_2;
        let s_2_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let s_2_1 = 1.0 - z * s_2_2; let s_2_0 = 1.0 - z * s_2_1; let z = self.damping * dt;
        let s_3_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let s_3_1 = 1.0 - z * s_3_2; let s_3_0 = 1.0 - z * s_3_1; let z = self.yaw_damping * t_0;
        let y_0_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let y_0_1 = 1.0 - z * y_0_2; let z = self.yaw_damping * t_1;
        let y_1_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let y_1_1 = 1.0 - z * y_1_2; let z = self.yaw_damping * t_2;
        let y_2_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let y_2_1 = 1.0 - z * y_2_2; let z = self.yaw_damping * dt;
        let y_3_2 = 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2 * (1.0 - z * (1.0 / 6.0)))));
        let y_3_1 = 1.0 - z * y_3_2; let y_3_0 = 1.0 - z * y_3_1; let by_w_0 = t_0 * y_0_1;
        let by_alpha_0 = t_0 * t_0 * y_0_2; let turn_0 = w * by_w_0 + alpha * by_alpha_0; let by_w_1 = t_1 * y_1_1;
        let by_alpha_1 = t_1 * t_1 * y_1_2; let turn_1 = w * by_w_1 + alpha * by_alpha_1; let by_w_2 = t_2 * y_2_1;
        let by_alpha_2 = t_2 * t_2 * y_2_2; let turn_2 = w * by_w_2 + alpha * by_alpha_2;
        let (sin, cos) = (theta + turn_1).sin_cos(); let z_0 = turn_0 - turn_1; let q = z_0 * z_0;
        let aside_0 = z_0 * (1.0 - q * (1.0 / 6.0) * (1.0 - q * (1.0 / 20.0) * (1.0 - q * (1.0 / 42.0) * (1.0 - q * (1.0 / 72.0) * (1.0 - q * (1.0 / 110.0))))));
        let ahead_0 = 1.0 - q * (1.0 / 2.0) * (1.0 - q * (1.0 / 12.0) * (1.0 - q * (1.0 / 30.0) * (1.0 - q * (1.0 / 56.0) * (1.0 - q * (1.0 / 90.0) * (1.0 - q * (1.0 / 132.0))))));
        let z_2 = turn_2 - turn_1; let q = z_2 * z_2;
        let aside_2 = z_2 * (1.0 - q * (1.0 / 6.0) * (1.0 - q * (1.0 / 20.0) * (1.0 - q * (1.0 / 42.0) * (1.0 - q * (1.0 / 72.0) * (1.0 - q * (1.0 / 110.0))))));
        let ahead_2 = 1.0 - q * (1.0 / 2.0) * (1.0 - q * (1.0 / 12.0) * (1.0 - q * (1.0 / 30.0) * (1.0 - q * (1.0 / 56.0) * (1.0 - q * (1.0 / 90.0) * (1.0 - q * (1.0 / 132.0))))));
        let b_0 = (5.0 / 18.0) * dt; let by_a_0 = t_0 * s_0_1; let part_0 = b_0 * (v * s_0_0 + a * by_a_0);
        let v_0 = b_0 * s_0_0; let a_0 = b_0 * by_a_0; let b_1 = (8.0 / 18.0) * dt; let by_a_1 = t_1 * s_1_1;
        let part_1 = b_1 * (v * s_1_0 + a * by_a_1); let v_1 = b_1 * s_1_0; let a_1 = b_1 * by_a_1;
        let b_2 = (5.0 / 18.0) * dt; let by_a_2 = t_2 * s_2_1; let part_2 = b_2 * (v * s_2_0 + a * by_a_2);
        let v_2 = b_2 * s_2_0; let a_2 = b_2 * by_a_2; let along = part_0 * ahead_0 + part_1 + part_2 * ahead_2;
        let across = part_0 * aside_0 + part_2 * aside_2; let x_way = along * cos - across * sin;
        let y_way = along * sin + across * cos; let along = v_0 * ahead_0 + v_1 + v_2 * ahead_2;
        let across = v_0 * aside_0 + v_2 * aside_2; let x_by_v = along * cos - across * sin;
        let y_by_v = along * sin + across * cos; let along = a_0 * ahead_0 + a_1 + a_2 * ahead_2;
        let across = a_0 * aside_0 + a_2 * aside_2; let x_by_a = along * cos - across * sin;
        let y_by_a = along * sin + across * cos; let along = -(part_0 * aside_0 * by_w_0 + part_2 * aside_2 * by_w_2);
        let across = part_0 * by_w_0 * ahead_0 + part_1 * by_w_1 + part_2 * by_w_2 * ahead_2;
        let x_by_w = along * cos - across * sin; let y_by_w = along * sin + across * cos;
        let along = -(part_0 * aside_0 * by_alpha_0 + part_2 * aside_2 * by_alpha_2);
        let across = part_0 * by_alpha_0 * ahead_0 + part_1 * by_alpha_1 + part_2 * by_alpha_2 * ahead_2;
        let x_by_alpha = along * cos - across * sin; let y_by_alpha = along * sin + across * cos;
        let x_by_theta = -y_way; let y_by_theta = x_way; let theta_by_w = dt * y_3_1;
        let theta_by_alpha = dt * dt * y_3_2; let v_by_v = s_3_0; let v_by_a = dt * s_3_1; let w_by_w = y_3_0;
        let w_by_alpha = theta_by_w; let x_by_left = x_by_a * self.a_by_torque - x_by_alpha * self.alpha_by_torque;
        let y_by_left = y_by_a * self.a_by_torque - y_by_alpha * self.alpha_by_torque;
        let x_by_right = x_by_a * self.a_by_torque + x_by_alpha * self.alpha_by_torque;
        let y_by_right = y_by_a * self.a_by_torque + y_by_alpha * self.alpha_by_torque;
        let theta_by_right = theta_by_alpha * self.alpha_by_torque; let w_by_right = w_by_alpha * self.alpha_by_torque;
        let v_by_torque = v_by_a * self.a_by_torque; let rate = (-ln_t).exp(); let z = rate * dt;
        let gone = z * (1.0 - z * 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2))));
        let left = 1.0 - gone; let e_by_t = -(s - e) * z * left; let walk_variance = self.walk * dt;
        self.mean = [x + x_way, y + y_way, theta + w * theta_by_w + alpha * theta_by_alpha, v * v_by_v + a * v_by_a, w * w_by_w + alpha * w_by_alpha, e + gone * (s - e), s, ln_t];
        let w_0_1 = self.u[0]; let w_0_2 = self.u[1] + x_by_theta; let w_1_2 = self.u[2] + y_by_theta;
        let w_0_3 = self.u[3] + x_by_theta * self.u[5] + x_by_v;
        let w_1_3 = self.u[4] + y_by_theta * self.u[5] + y_by_v; let w_2_3 = self.u[5]; let w_3_3 = v_by_v;
        let w_0_4 = self.u[6] + x_by_theta * self.u[8] + x_by_v * self.u[9] + x_by_w;
        let w_1_4 = self.u[7] + y_by_theta * self.u[8] + y_by_v * self.u[9] + y_by_w;
        let w_2_4 = self.u[8] + theta_by_w; let w_3_4 = v_by_v * self.u[9]; let w_4_4 = w_by_w;
        let w_0_5 = self.u[10] + x_by_theta * self.u[12] + x_by_v * self.u[13] + x_by_w * self.u[14];
        let w_1_5 = self.u[11] + y_by_theta * self.u[12] + y_by_v * self.u[13] + y_by_w * self.u[14];
        let w_2_5 = self.u[12] + theta_by_w * self.u[14]; let w_3_5 = v_by_v * self.u[13];
        let w_4_5 = w_by_w * self.u[14]; let w_5_5 = left;
        let w_0_6 = self.u[15] + x_by_theta * self.u[17] + x_by_v * self.u[18] + x_by_w * self.u[19];
        let w_1_6 = self.u[16] + y_by_theta * self.u[17] + y_by_v * self.u[18] + y_by_w * self.u[19];
        let w_2_6 = self.u[17] + theta_by_w * self.u[19]; let w_3_6 = v_by_v * self.u[18];
        let w_4_6 = w_by_w * self.u[19]; let w_5_6 = left * self.u[20] + gone;
        let w_0_7 = self.u[21] + x_by_theta * self.u[23] + x_by_v * self.u[24] + x_by_w * self.u[25];
        let w_1_7 = self.u[22] + y_by_theta * self.u[23] + y_by_v * self.u[24] + y_by_w * self.u[25];
        let w_2_7 = self.u[23] + theta_by_w * self.u[25]; let w_3_7 = v_by_v * self.u[24];
        let w_4_7 = w_by_w * self.u[25]; let w_5_7 = left * self.u[26] + gone * self.u[27] + e_by_t;
        let w_6_7 = self.u[27]; let d_0 = self.d[0]; let d_1 = self.d[1]; let d_2 = self.d[2]; let d_3 = self.d[3];
        let d_4 = self.d[4]; let d_5 = self.d[5]; let d_6 = self.d[6]; let q_0 = self.torque_variance;
        let q_1 = self.torque_variance; let q_2 = walk_variance; self.u[21] = w_0_7; self.u[22] = w_1_7;
        self.u[23] = w_2_7; self.u[24] = w_3_7; self.u[25] = w_4_7; self.u[26] = w_5_7; self.u[27] = w_6_7;
        let p_6 = d_6 + q_2; self.d[6] = p_6; let r_6 = 1.0 / p_6; let u_0_6 = (d_6 * w_0_6) * r_6; self.u[15] = u_0_6;
        let w_0_6_6 = w_0_6 - u_0_6; let w_0_6_10 = -(u_0_6); let u_1_6 = (d_6 * w_1_6) * r_6; self.u[16] = u_1_6;
        let w_1_6_6 = w_1_6 - u_1_6; let w_1_6_10 = -(u_1_6); let u_2_6 = (d_6 * w_2_6) * r_6; self.u[17] = u_2_6;
        let w_2_6_6 = w_2_6 - u_2_6; let w_2_6_10 = -(u_2_6); let u_3_6 = (d_6 * w_3_6) * r_6; self.u[18] = u_3_6;
        let w_3_6_6 = w_3_6 - u_3_6; let w_3_6_10 = -(u_3_6); let u_4_6 = (d_6 * w_4_6) * r_6; self.u[19] = u_4_6;
        let w_4_6_6 = w_4_6 - u_4_6; let w_4_6_10 = -(u_4_6); let u_5_6 = (d_6 * w_5_6 + q_2) * r_6;
        self.u[20] = u_5_6; let w_5_6_6 = w_5_6 - u_5_6; let w_5_6_10 = 1.0 - u_5_6; let f_5_5 = d_5 * w_5_5;
        let f_5_6 = d_6 * w_5_6_6; let f_5_10 = q_2 * w_5_6_10;
        let p_5 = f_5_5 * w_5_5 + f_5_6 * w_5_6_6 + f_5_10 * w_5_6_10; self.d[5] = p_5; let r_5 = 1.0 / p_5;
        let u_0_5 = (f_5_5 * w_0_5 + f_5_6 * w_0_6_6 + f_5_10 * w_0_6_10) * r_5; self.u[10] = u_0_5;
        let w_0_5_5 = w_0_5 - u_0_5 * w_5_5; let w_0_5_6 = w_0_6_6 - u_0_5 * w_5_6_6;
        let w_0_5_10 = w_0_6_10 - u_0_5 * w_5_6_10;
        let u_1_5 = (f_5_5 * w_1_5 + f_5_6 * w_1_6_6 + f_5_10 * w_1_6_10) * r_5; self.u[11] = u_1_5;
        let w_1_5_5 = w_1_5 - u_1_5 * w_5_5; let w_1_5_6 = w_1_6_6 - u_1_5 * w_5_6_6;
        let w_1_5_10 = w_1_6_10 - u_1_5 * w_5_6_10;
        let u_2_5 = (f_5_5 * w_2_5 + f_5_6 * w_2_6_6 + f_5_10 * w_2_6_10) * r_5; self.u[12] = u_2_5;
        let w_2_5_5 = w_2_5 - u_2_5 * w_5_5; let w_2_5_6 = w_2_6_6 - u_2_5 * w_5_6_6;
        let w_2_5_10 = w_2_6_10 - u_2_5 * w_5_6_10;
        let u_3_5 = (f_5_5 * w_3_5 + f_5_6 * w_3_6_6 + f_5_10 * w_3_6_10) * r_5; self.u[13] = u_3_5;
        let w_3_5_5 = w_3_5 - u_3_5 * w_5_5; let w_3_5_6 = w_3_6_6 - u_3_5 * w_5_6_6;
        let w_3_5_10 = w_3_6_10 - u_3_5 * w_5_6_10;
        let u_4_5 = (f_5_5 * w_4_5 + f_5_6 * w_4_6_6 + f_5_10 * w_4_6_10) * r_5; self.u[14] = u_4_5;
        let w_4_5_5 = w_4_5 - u_4_5 * w_5_5; let w_4_5_6 = w_4_6_6 - u_4_5 * w_5_6_6;
        let w_4_5_10 = w_4_6_10 - u_4_5 * w_5_6_10; let f_4_4 = d_4 * w_4_4; let f_4_5 = d_5 * w_4_5_5;
        let f_4_6 = d_6 * w_4_5_6; let f_4_8 = q_0 * -w_by_right; let f_4_9 = q_1 * w_by_right;
        let f_4_10 = q_2 * w_4_5_10;
        let p_4 = f_4_4 * w_4_4 + f_4_5 * w_4_5_5 + f_4_6 * w_4_5_6 + f_4_8 * -w_by_right + f_4_9 * w_by_right + f_4_10 * w_4_5_10;
        self.d[4] = p_4; let r_4 = 1.0 / p_4;
        let u_0_4 = (f_4_4 * w_0_4 + f_4_5 * w_0_5_5 + f_4_6 * w_0_5_6 + f_4_8 * x_by_left + f_4_9 * x_by_right + f_4_10 * w_0_5_10) * r_4;
        self.u[6] = u_0_4; let w_0_4_4 = w_0_4 - u_0_4 * w_4_4; let w_0_4_5 = w_0_5_5 - u_0_4 * w_4_5_5;
        let w_0_4_6 = w_0_5_6 - u_0_4 * w_4_5_6; let w_0_4_8 = x_by_left - u_0_4 * -w_by_right;
        let w_0_4_9 = x_by_right - u_0_4 * w_by_right; let w_0_4_10 = w_0_5_10 - u_0_4 * w_4_5_10;
        let u_1_4 = (f_4_4 * w_1_4 + f_4_5 * w_1_5_5 + f_4_6 * w_1_5_6 + f_4_8 * y_by_left + f_4_9 * y_by_right + f_4_10 * w_1_5_10) * r_4;
        self.u[7] = u_1_4; let w_1_4_4 = w_1_4 - u_1_4 * w_4_4; let w_1_4_5 = w_1_5_5 - u_1_4 * w_4_5_5;
        let w_1_4_6 = w_1_5_6 - u_1_4 * w_4_5_6; let w_1_4_8 = y_by_left - u_1_4 * -w_by_right;
        let w_1_4_9 = y_by_right - u_1_4 * w_by_right; let w_1_4_10 = w_1_5_10 - u_1_4 * w_4_5_10;
        let u_2_4 = (f_4_4 * w_2_4 + f_4_5 * w_2_5_5 + f_4_6 * w_2_5_6 + f_4_8 * -theta_by_right + f_4_9 * theta_by_right + f_4_10 * w_2_5_10) * r_4;
        self.u[8] = u_2_4; let w_2_4_4 = w_2_4 - u_2_4 * w_4_4; let w_2_4_5 = w_2_5_5 - u_2_4 * w_4_5_5;
        let w_2_4_6 = w_2_5_6 - u_2_4 * w_4_5_6; let w_2_4_8 = -theta_by_right - u_2_4 * -w_by_right;
        let w_2_4_9 = theta_by_right - u_2_4 * w_by_right; let w_2_4_10 = w_2_5_10 - u_2_4 * w_4_5_10;
        let u_3_4 = (f_4_4 * w_3_4 + f_4_5 * w_3_5_5 + f_4_6 * w_3_5_6 + f_4_8 * v_by_torque + f_4_9 * v_by_torque + f_4_10 * w_3_5_10) * r_4;
        self.u[9] = u_3_4; let w_3_4_4 = w_3_4 - u_3_4 * w_4_4; let w_3_4_5 = w_3_5_5 - u_3_4 * w_4_5_5;
        let w_3_4_6 = w_3_5_6 - u_3_4 * w_4_5_6; let w_3_4_8 = v_by_torque - u_3_4 * -w_by_right;
        let w_3_4_9 = v_by_torque - u_3_4 * w_by_right; let w_3_4_10 = w_3_5_10 - u_3_4 * w_4_5_10;
        let f_3_3 = d_3 * w_3_3; let f_3_4 = d_4 * w_3_4_4; let f_3_5 = d_5 * w_3_4_5; let f_3_6 = d_6 * w_3_4_6;
        let f_3_8 = q_0 * w_3_4_8; let f_3_9 = q_1 * w_3_4_9; let f_3_10 = q_2 * w_3_4_10;
        let p_3 = f_3_3 * w_3_3 + f_3_4 * w_3_4_4 + f_3_5 * w_3_4_5 + f_3_6 * w_3_4_6 + f_3_8 * w_3_4_8 + f_3_9 * w_3_4_9 + f_3_10 * w_3_4_10;
        self.d[3] = p_3; let r_3 = 1.0 / p_3;
        let u_0_3 = (f_3_3 * w_0_3 + f_3_4 * w_0_4_4 + f_3_5 * w_0_4_5 + f_3_6 * w_0_4_6 + f_3_8 * w_0_4_8 + f_3_9 * w_0_4_9 + f_3_10 * w_0_4_10) * r_3;
        self.u[3] = u_0_3; let w_0_3_3 = w_0_3 - u_0_3 * w_3_3; let w_0_3_4 = w_0_4_4 - u_0_3 * w_3_4_4;
        let w_0_3_5 = w_0_4_5 - u_0_3 * w_3_4_5; let w_0_3_6 = w_0_4_6 - u_0_3 * w_3_4_6;
        let w_0_3_8 = w_0_4_8 - u_0_3 * w_3_4_8; let w_0_3_9 = w_0_4_9 - u_0_3 * w_3_4_9;
        let w_0_3_10 = w_0_4_10 - u_0_3 * w_3_4_10;
        let u_1_3 = (f_3_3 * w_1_3 + f_3_4 * w_1_4_4 + f_3_5 * w_1_4_5 + f_3_6 * w_1_4_6 + f_3_8 * w_1_4_8 + f_3_9 * w_1_4_9 + f_3_10 * w_1_4_10) * r_3;
        self.u[4] = u_1_3; let w_1_3_3 = w_1_3 - u_1_3 * w_3_3; let w_1_3_4 = w_1_4_4 - u_1_3 * w_3_4_4;
        let w_1_3_5 = w_1_4_5 - u_1_3 * w_3_4_5; let w_1_3_6 = w_1_4_6 - u_1_3 * w_3_4_6;
        let w_1_3_8 = w_1_4_8 - u_1_3 * w_3_4_8; let w_1_3_9 = w_1_4_9 - u_1_3 * w_3_4_9;
        let w_1_3_10 = w_1_4_10 - u_1_3 * w_3_4_10;
        let u_2_3 = (f_3_3 * w_2_3 + f_3_4 * w_2_4_4 + f_3_5 * w_2_4_5 + f_3_6 * w_2_4_6 + f_3_8 * w_2_4_8 + f_3_9 * w_2_4_9 + f_3_10 * w_2_4_10) * r_3;
        self.u[5] = u_2_3; let w_2_3_3 = w_2_3 - u_2_3 * w_3_3; let w_2_3_4 = w_2_4_4 - u_2_3 * w_3_4_4;
        let w_2_3_5 = w_2_4_5 - u_2_3 * w_3_4_5; let w_2_3_6 = w_2_4_6 - u_2_3 * w_3_4_6;
        let w_2_3_8 = w_2_4_8 - u_2_3 * w_3_4_8; let w_2_3_9 = w_2_4_9 - u_2_3 * w_3_4_9;
        let w_2_3_10 = w_2_4_10 - u_2_3 * w_3_4_10; let f_2_3 = d_3 * w_2_3_3; let f_2_4 = d_4 * w_2_3_4;
        let f_2_5 = d_5 * w_2_3_5; let f_2_6 = d_6 * w_2_3_6; let f_2_8 = q_0 * w_2_3_8; let f_2_9 = q_1 * w_2_3_9;
        let f_2_10 = q_2 * w_2_3_10;
        let p_2 = d_2 + f_2_3 * w_2_3_3 + f_2_4 * w_2_3_4 + f_2_5 * w_2_3_5 + f_2_6 * w_2_3_6 + f_2_8 * w_2_3_8 + f_2_9 * w_2_3_9 + f_2_10 * w_2_3_10;
        self.d[2] = p_2; let r_2 = 1.0 / p_2;
        let u_0_2 = (d_2 * w_0_2 + f_2_3 * w_0_3_3 + f_2_4 * w_0_3_4 + f_2_5 * w_0_3_5 + f_2_6 * w_0_3_6 + f_2_8 * w_0_3_8 + f_2_9 * w_0_3_9 + f_2_10 * w_0_3_10) * r_2;
        self.u[1] = u_0_2; let w_0_2_2 = w_0_2 - u_0_2; let w_0_2_3 = w_0_3_3 - u_0_2 * w_2_3_3;
        let w_0_2_4 = w_0_3_4 - u_0_2 * w_2_3_4; let w_0_2_5 = w_0_3_5 - u_0_2 * w_2_3_5;
        let w_0_2_6 = w_0_3_6 - u_0_2 * w_2_3_6; let w_0_2_8 = w_0_3_8 - u_0_2 * w_2_3_8;
        let w_0_2_9 = w_0_3_9 - u_0_2 * w_2_3_9; let w_0_2_10 = w_0_3_10 - u_0_2 * w_2_3_10;
        let u_1_2 = (d_2 * w_1_2 + f_2_3 * w_1_3_3 + f_2_4 * w_1_3_4 + f_2_5 * w_1_3_5 + f_2_6 * w_1_3_6 + f_2_8 * w_1_3_8 + f_2_9 * w_1_3_9 + f_2_10 * w_1_3_10) * r_2;
        self.u[2] = u_1_2; let w_1_2_2 = w_1_2 - u_1_2; let w_1_2_3 = w_1_3_3 - u_1_2 * w_2_3_3;
        let w_1_2_4 = w_1_3_4 - u_1_2 * w_2_3_4; let w_1_2_5 = w_1_3_5 - u_1_2 * w_2_3_5;
        let w_1_2_6 = w_1_3_6 - u_1_2 * w_2_3_6; let w_1_2_8 = w_1_3_8 - u_1_2 * w_2_3_8;
        let w_1_2_9 = w_1_3_9 - u_1_2 * w_2_3_9; let w_1_2_10 = w_1_3_10 - u_1_2 * w_2_3_10; let f_1_2 = d_2 * w_1_2_2;
        let f_1_3 = d_3 * w_1_2_3; let f_1_4 = d_4 * w_1_2_4; let f_1_5 = d_5 * w_1_2_5; let f_1_6 = d_6 * w_1_2_6;
        let f_1_8 = q_0 * w_1_2_8; let f_1_9 = q_1 * w_1_2_9; let f_1_10 = q_2 * w_1_2_10;
        let p_1 = d_1 + f_1_2 * w_1_2_2 + f_1_3 * w_1_2_3 + f_1_4 * w_1_2_4 + f_1_5 * w_1_2_5 + f_1_6 * w_1_2_6 + f_1_8 * w_1_2_8 + f_1_9 * w_1_2_9 + f_1_10 * w_1_2_10;
        self.d[1] = p_1; let r_1 = 1.0 / p_1;
        let u_0_1 = (d_1 * w_0_1 + f_1_2 * w_0_2_2 + f_1_3 * w_0_2_3 + f_1_4 * w_0_2_4 + f_1_5 * w_0_2_5 + f_1_6 * w_0_2_6 + f_1_8 * w_0_2_8 + f_1_9 * w_0_2_9 + f_1_10 * w_0_2_10) * r_1;
        self.u[0] = u_0_1; let w_0_1_1 = w_0_1 - u_0_1; let w_0_1_2 = w_0_2_2 - u_0_1 * w_1_2_2;
        let w_0_1_3 = w_0_2_3 - u_0_1 * w_1_2_3; let w_0_1_4 = w_0_2_4 - u_0_1 * w_1_2_4;
        let w_0_1_5 = w_0_2_5 - u_0_1 * w_1_2_5; let w_0_1_6 = w_0_2_6 - u_0_1 * w_1_2_6;
        let w_0_1_8 = w_0_2_8 - u_0_1 * w_1_2_8; let w_0_1_9 = w_0_2_9 - u_0_1 * w_1_2_9;
        let w_0_1_10 = w_0_2_10 - u_0_1 * w_1_2_10; let f_0_1 = d_1 * w_0_1_1; let f_0_2 = d_2 * w_0_1_2;
        let f_0_3 = d_3 * w_0_1_3; let f_0_4 = d_4 * w_0_1_4; let f_0_5 = d_5 * w_0_1_5; let f_0_6 = d_6 * w_0_1_6;
        let f_0_8 = q_0 * w_0_1_8; let f_0_9 = q_1 * w_0_1_9; let f_0_10 = q_2 * w_0_1_10;
        let p_0 = d_0 + f_0_1 * w_0_1_1 + f_0_2 * w_0_1_2 + f_0_3 * w_0_1_3 + f_0_4 * w_0_1_4 + f_0_5 * w_0_1_5 + f_0_6 * w_0_1_6 + f_0_8 * w_0_1_8 + f_0_9 * w_0_1_9 + f_0_10 * w_0_1_10;
        self.d[0] = p_0;
    }
}
