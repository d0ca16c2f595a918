//! |G_real/n - G_sim/m| ≤ 3 √(f (2 G_real/n² + 2 G_sim/m²)): what is left without a name, held against the simulator's log
//!
//! G: gain in ln evidence of free corrections of an equation, nats, of standard deviation √(2 G); n, m: rows; f: how far the twin errs.

use crate::effects::drive::by_id;
use crate::gap::answer::Answer;
use crate::gap::drive::regressors::basis::Equation;
use crate::gap::drive::regressors::candidates::VARYING;
use std::collections::BTreeMap;

/// Standard deviations by which what is left without a name must be stronger than in the simulator's log to be a gap.
const STRONGER: f64 = 3.0;

/// Whether what is left without a name is no stronger, per reading, than the corrections that the simulator's log asks for, equation
/// by equation; `rows` of recording and simulator, `factor` as in [`super::quality::Misfit`].
pub(super) fn inherits_unknown(answer: &Answer, account: &Answer, rows: [usize; 2], factor: f64) -> bool {
    let (own, other) = (unnamed(answer), unnamed(account));
    let alone = corrections(account);
    // without free forms the recording is held against by what a correction would gain alone
    let own = if own.is_empty() { corrections(answer) } else { own };
    if own.is_empty() {
        return false;
    }
    let [n, m] = rows.map(|n| n.max(1) as f64);
    own.iter().all(|(place, here)| {
        let there = [&other, &alone].into_iter().filter_map(|gains| gains.get(place)).copied().fold(0.0, f64::max);
        let there = there.max(of_channel(account, place));
        let std = (factor * (2.0 * here / n.powi(2) + 2.0 * there / m.powi(2))).sqrt();
        here / n - there / m <= STRONGER * std
    })
}

/// Gains of free corrections of all equations of a channel, nats; of an effect that varies, of its channel: another law in its place
/// bends the same readings.
fn of_channel(account: &Answer, form: &str) -> f64 {
    let about = form.strip_prefix(VARYING).and_then(by_id).map(|effect| effect.about());
    let own = |channel: &str| about.is_some_and(|about| about.channel == channel);
    account.equations.iter().filter(|e| own(&e.channel)).map(|e| e.gain_nats.max(0.0)).sum()
}

/// Expected gains of the free forms beside the named effects, nats, by equation; by their ids where they have none.
fn unnamed(answer: &Answer) -> BTreeMap<&str, f64> {
    let mut gains = BTreeMap::new();
    for form in &answer.free_forms {
        let place = Equation::of_free_form(&form.id).map_or(&*form.id, |equation| equation.words());
        *gains.entry(place).or_default() += form.probability * form.share_nats.max(0.0);
    }
    gains
}

/// Gains of a free correction of the nominal model alone, nats, by equation.
fn corrections(answer: &Answer) -> BTreeMap<&str, f64> {
    answer.equations.iter().map(|e| (e.equation.as_str(), e.gain_nats.max(0.0))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::ids;
    use serde_json::{Value, json};

    /// An answer with these free forms and their shares, and what a correction of each equation gains alone, nats.
    fn said(forms: &[(&str, f64)], equations: &[(Equation, f64)]) -> Answer {
        let form = |f: &(&str, f64)| json!({"id": f.0, "probability": 0.9, "share_nats": f.1, "description": ""});
        let equation = |e: &(Equation, f64)| json!({"equation": e.0.words(), "channel": e.0.channel(), "gain_nats": e.1, "follows": ""});
        let [forms, equations] =
            [forms.iter().map(form).collect::<Value>(), equations.iter().map(equation).collect::<Value>()];
        serde_json::from_value(json!({
            "verdict": "unknown", "main": null, "main_probability": 0.0, "none_probability": 0.0, "unknown_probability": 0.9,
            "effects": [], "together": [], "cannot_tell_apart": [], "where": null, "gap": [],
            "free_forms": forms, "equations": equations,
        }))
        .unwrap()
    }

    /// The equations hold what a named effect explains, the free forms what is left beside it.
    #[test]
    fn what_is_left_is_held_against_the_simulator_and_not_what_has_a_name() {
        let (early, gyro) = (("free.pose_along.speed", 80.0), Equation::Gyro);
        let simulator = said(&[early], &[(Equation::PoseAlong, 85.0)]);
        let inherits = |real: &Answer| inherits_unknown(real, &simulator, [9000, 9000], 1.0);
        assert!(inherits(&said(&[early], &[(gyro, 900.0), (Equation::PoseAlong, 85.0)])));
        assert!(!inherits(&said(&[early, ("free.gyro.speed", 100.0)], &[(gyro, 900.0)])));
        // 95 nats more, where the difference has a standard deviation of √(2 (180 + 85)) = 23
        assert!(!inherits(&said(&[(early.0, 200.0)], &[])));
        // as much in a third of the rows is three times as strong
        assert!(!inherits_unknown(&said(&[early], &[]), &simulator, [3000, 9000], 1.0));
        // where no free form was found, all that an equation asks for counts
        assert!(inherits(&said(&[], &[(Equation::PoseAlong, 85.0)])) && !inherits(&said(&[], &[(gyro, 900.0)])));
        assert!(!inherits(&said(&[], &[])));
        // a reference that is late by another law bends the same readings; a gyro does not
        let [late, bent] = [ids::pose_noise(), ids::scale_factor()].map(|id| format!("{VARYING}{id}"));
        assert!(inherits(&said(&[(&late, 85.0)], &[])) && !inherits(&said(&[(&bent, 85.0)], &[])));
    }
}
