use super::*;

const LAWS: [TractionLaw; 4] = [
    TractionLaw::Burckhardt(Burckhardt { c1: 1.2801, c2: 23.99, c3: 0.52 }),
    TractionLaw::Pacejka(Pacejka { b: 10.0, c: 1.9, d: 0.9, e: 0.97 }),
    TractionLaw::Dugoff(Dugoff { friction: 0.8, stiffness: 20.0 }),
    TractionLaw::Linear(Linear { stiffness: 20.0, friction: 0.7 }),
];

/// Every law passes this.
#[test]
fn laws_are_odd_positive_bounded_and_their_slopes_are_those_of_differences() {
    for law in LAWS {
        assert_eq!(law.friction(0.0)[0], 0.0);
        assert!(law.friction(0.0)[1] > 1.0, "{}", law.name());
        let [peak_slip, peak] = law.peak();
        for k in 1..=2000 {
            let slip = 1e-3 * f64::from(k);
            let [mu, slope] = law.friction(slip);
            let [back, back_slope] = law.friction(-slip);
            assert_eq!((mu, slope), (-back, back_slope), "{} {slip}", law.name());
            assert!(mu > 0.0 && mu <= peak * (1.0 + 1e-12), "{} {slip}: {mu} {peak}", law.name());
            assert!(slip > peak_slip || slope >= 0.0, "{} {slip}", law.name());
            // away from the corners: of the linear law's saturation, and of full sliding
            if (slip - 0.035).abs() < 2e-3 || (slip - 1.0).abs() < 2e-3 {
                continue;
            }
            let eps = 1e-6;
            let difference = (law.friction(slip + eps)[0] - law.friction(slip - eps)[0]) / (2.0 * eps);
            // truncation eps² times the third derivative, at most k c2² of a few thousand; rounding 1e-16/eps
            assert!((difference - slope).abs() < 1e-7, "{} {slip}: {difference} {slope}", law.name());
        }
    }
}

#[test]
fn peaks_are_where_theory_has_them() {
    // Burckhardt: ln(c1 c2/c3)/c2
    let [slip, mu] = LAWS[0].peak();
    assert!((slip - (1.2801f64 * 23.99 / 0.52).ln() / 23.99).abs() < 1e-12, "{slip}");
    assert!((mu - 1.17).abs() < 0.005, "{mu}");
    assert!((LAWS[0].friction(0.0)[1] - 30.19).abs() < 0.01);
    // Pacejka: D at the peak; dμ/dλ(0) = B C D
    assert!((LAWS[1].peak()[1] - 0.9).abs() < 1e-12);
    assert!((LAWS[1].friction(0.0)[1] - 10.0 * 1.9 * 0.9).abs() < 1e-12);
    // Dugoff has none: full slip carries most
    assert_eq!(LAWS[2].peak(), [1.0, 0.8]);
    let [slip, mu] = LAWS[3].peak();
    assert!((slip - 0.035).abs() < 1e-12 && mu == 0.7);
}

#[test]
fn surfaces_grip_in_their_order() {
    let peaks: Vec<f64> = Surface::ALL.map(|s| TractionLaw::Burckhardt(s.law()).peak()[1]).to_vec();
    assert!(peaks.windows(2).all(|w| w[0] < w[1]), "{peaks:?}");
    for surface in Surface::ALL {
        assert_eq!(Surface::parse(surface.name()), Some(surface));
    }
}

#[test]
fn slip_is_the_quotient_and_its_derivatives_are_those_of_differences() {
    let low = 0.02;
    assert_eq!(Slip::new(0.5, 0.5, low).slip, 0.0);
    assert!((Slip::new(0.5, 0.4, low).slip - 0.2).abs() < 1e-15);
    assert!((Slip::new(0.4, 0.5, low).slip + 0.2).abs() < 1e-15);
    assert_eq!(Slip::new(0.5, -0.5, low).slip, 2.0);
    assert!((Slip::new(0.001, 0.0, low).slip - 0.05).abs() < 1e-15);
    let speeds = [-0.7, -0.31, -0.011, -0.003, 0.004, 0.012, 0.29, 0.6];
    for rim in speeds {
        for ground in speeds {
            let slip = Slip::new(rim, ground, low);
            let mirrored = Slip::new(-rim, -ground, low);
            assert_eq!((slip.slip, slip.by_rim, slip.by_ground), (-mirrored.slip, mirrored.by_rim, mirrored.by_ground));
            let eps = 1e-7;
            let by_rim =
                (Slip::new(rim + eps, ground, low).slip - Slip::new(rim - eps, ground, low).slip) / (2.0 * eps);
            let by_ground =
                (Slip::new(rim, ground + eps, low).slip - Slip::new(rim, ground - eps, low).slip) / (2.0 * eps);
            // rounding 1e-16/eps on values up to 2, truncation eps²/scale³
            assert!((by_rim - slip.by_rim).abs() < 1e-6, "{rim} {ground}: {by_rim} {}", slip.by_rim);
            assert!((by_ground - slip.by_ground).abs() < 1e-6, "{rim} {ground}: {by_ground} {}", slip.by_ground);
        }
    }
}
