//! The node's report on itself once a second, as `diagnostic_msgs`.

use super::messages::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, stamp_now};
use super::options::Options;
use super::report::{Gyro, Report};

const OK: u8 = 0;
const WARN: u8 = 1;
const ERROR: u8 = 2;

/// The status of each gyro by the last two reports; `refused` says why a configuration is not used.
pub(super) fn status<'a>(
    options: &Options,
    now: &Report,
    before: Option<&Report>,
    refused: impl Iterator<Item = Option<&'a str>>,
) -> DiagnosticArray {
    let header = Header { stamp: stamp_now(), ..Header::default() };
    let status = refused.enumerate().map(|(k, refused)| of_gyro(k, options, now, before, refused)).collect();
    DiagnosticArray { header, status }
}

fn of_gyro(
    k: usize,
    options: &Options,
    now: &Report,
    before: Option<&Report>,
    refused: Option<&str>,
) -> DiagnosticStatus {
    let gyro = now.gyros[k].as_ref();
    let came = now.counts.samples - before.map_or(0, |b| b.counts.samples);
    let (level, message) = verdict(gyro.filter(|_| came > 0), options, now, before, refused);
    let mut values = Vec::new();
    let mut put = |key: &str, value: String| values.push(KeyValue { key: key.into(), value });
    if let Some(got) = gyro.and_then(|g| g.last) {
        put("warm_up_age_s", format!("{:.1}", got.age_s));
        put("bias_rad_s", format!("{:.6e}", got.bias_rad_s));
        put("bias_std_rad_s", format!("{:.3e}", got.bias_std_rad_s));
        put("at_rest", got.flags.at_rest.to_string());
        put("outside_validity", got.flags.outside_validity.to_string());
    }
    if let Some(Gyro { corrector, .. }) = gyro {
        put("age_since_power_on_s", format!("{:.1}", corrector.since_power_on_s()));
        let [learnt, refused] = corrector.blocks();
        put("rest_blocks_learnt", learnt.to_string());
        put("steady_blocks_too_far_from_the_bias", refused.to_string());
        if let Some(nis) = corrector.nis() {
            put("nis_last", format!("{:.2}", nis.last));
            put("nis_mean", format!("{:.2}", nis.mean));
            put("nis_blocks", nis.blocks.to_string());
        }
    }
    let seconds = now.now_s - before.map_or(0.0, |b| b.now_s);
    put("rate_hz", format!("{:.1}", came as f64 / seconds.max(1e-3)));
    let c = &now.counts;
    for (key, count) in [
        ("samples", c.samples),
        ("malformed", c.malformed),
        ("not_sent", c.unsent),
        ("not_recorded", c.unrecorded),
        ("stamps_repeated", c.repeated),
        ("stamps_overtaken", c.overtaken),
        ("gaps", c.gaps),
        ("clock_jumps", c.jumps),
        ("not_finite", c.not_finite),
        ("passed_through", c.passed_through),
    ] {
        put(key, count.to_string());
    }
    let axis = if options.gyros.len() == 1 { String::new() } else { format!(" {}", options.gyros[k].axis.name()) };
    let name = format!("{}: gyro bias{axis}", options.name);
    DiagnosticStatus { level, name, message, hardware_id: options.topics.imu.clone(), values }
}

/// Level and message: the worst that holds.
fn verdict(
    gyro: Option<&Gyro>,
    options: &Options,
    now: &Report,
    before: Option<&Report>,
    refused: Option<&str>,
) -> (u8, String) {
    let counts = before.map(|b| b.counts).unwrap_or_default();
    let more = |now: u64, before: u64| now > before;
    let Some((corrector, got)) = gyro.and_then(|g| Some((&g.corrector, g.last?))) else {
        return (ERROR, format!("nothing arrives on {}", options.topics.imu));
    };
    let warnings = [
        (got.flags.outside_validity, "the model was not fitted here: readings pass through uncorrected"),
        (got.flags.no_temperature, "no temperature of late: readings pass through uncorrected"),
        (corrector.nis().is_some_and(|n| n.inconsistent), "NIS is too large: fit the gyro anew"),
        (more(now.counts.jumps, counts.jumps), "the sender's clock was set"),
        (more(now.counts.malformed, counts.malformed), "messages that cannot be read"),
        (more(now.counts.not_finite, counts.not_finite), "readings that are no number"),
        (more(now.counts.unsent, counts.unsent), "messages that could not be sent"),
        (more(now.counts.unrecorded, counts.unrecorded), "the disk is too slow for the recording"),
    ];
    let mut said: Vec<&str> = warnings.iter().filter(|(holds, _)| *holds).map(|(_, text)| *text).collect();
    said.extend(refused);
    if said.is_empty() { (OK, "corrected".into()) } else { (WARN, said.join("; ")) }
}
