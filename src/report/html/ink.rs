//! Colours of a chart on light and on dark paper.

use crate::report::plot::Color;

/// Lightness of the dark paper: a colour as light as white paper becomes as dark as that.
const DARK_PAPER: f64 = 20.0;

fn hex(Color(r, g, b): Color) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Colours up to this lightness, 0 to 1, are lines and text; lighter ones are areas under them.
const LINES: f64 = 0.68;
/// Least lightness of a line on dark paper.
const READABLE: f64 = 0.58;

/// The colour with its lightness turned over, hue and chroma kept: tints towards white become tints towards dark paper. Lines are
/// at least so light that they can be seen.
fn dark(Color(r, g, b): Color) -> Color {
    let ends = f64::from(r.max(g).max(b)) + f64::from(r.min(g).min(b));
    let lightness = ends / 510.0;
    let wanted = if lightness < LINES { (1.0 - lightness).max(READABLE) } else { 1.0 - lightness };
    let turned = 255.0 * (wanted - lightness);
    let place = |v: u8| (DARK_PAPER + (turned + f64::from(v)) * (255.0 - DARK_PAPER) / 255.0).round() as u8;
    Color(place(r), place(g), place(b))
}

/// The colour on light and on dark paper, `#rrggbb`.
pub(super) fn pair(color: Color) -> [String; 2] {
    [hex(color), hex(dark(color))]
}

/// The value of a `style` attribute that gives an element of class `mark` its colour.
pub(super) fn style(color: Color) -> String {
    let [light, dark] = pair(color);
    format!("--l:{light};--d:{dark}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::palette;

    #[test]
    fn dark_paper_takes_the_place_of_white() {
        assert_eq!(pair(palette::WHITE), ["#ffffff", "#141414"]);
        let [light, dark] = pair(palette::BLUE);
        assert_eq!((light.as_str(), dark.as_str()), ("#0072b2", "#5bc4ff"));
        for color in palette::SERIES {
            let Color(r, g, b) = super::dark(color);
            assert!(r.max(g).max(b) > 150, "{color:?}");
        }
    }
}
