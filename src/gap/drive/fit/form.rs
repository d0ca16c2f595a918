//! s² = 2 E δ²/K:   whitened error of the form of laws that close E nats, along one of K directions

/// Relative error of the form of a law that may bend, and number of directions over which it is spread: about the
/// number of coordinates in the library. The same tenth as for coefficients that are not constant.
pub(crate) const FORM: f64 = 0.1;
const DIRECTIONS: f64 = 40.0;

/// Part of `nats` that errors in the form of other, bendable laws may explain, nats, at most all of it. Along one
/// direction the whitened error of the form is normal with variance s² = 2 E δ²/K, where these laws close E =
/// `bent_nats`.
pub(crate) fn form_nats(nats: f64, bent_nats: f64) -> f64 {
    let square = form_variance(bent_nats);
    (nats.max(0.0) * square / (1.0 + square) - 0.5 * square.ln_1p()).max(0.0)
}

/// s² of [`form_nats`].
fn form_variance(bent_nats: f64) -> f64 {
    2.0 * bent_nats.max(0.0) * FORM * FORM / DIRECTIONS
}

/// Nats that errors in the form of laws that close `bent_nats` bring along one direction, at three standard deviations.
pub(crate) fn most_form_nats(bent_nats: f64) -> f64 {
    4.5 * form_variance(bent_nats)
}
