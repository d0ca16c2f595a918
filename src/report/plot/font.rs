//! The built-in font: a subset of DejaVu Sans (see `fonts/README.md`).

use super::bad;
use crate::error::Result;
use ab_glyph::{Font, FontRef, Glyph, PxScale, point};
use std::sync::LazyLock;

/// `font-family` of an SVG: viewers take the first that they have. Verdana and DejaVu Sans share their widths, so
/// that no text outgrows the place that was measured for it.
pub(super) const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";

static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("fonts/DejaVuSans.subset.ttf")).ok());

/// The font and its units per em.
fn font() -> Result<(&'static FontRef<'static>, f32)> {
    let font = FONT.as_ref().and_then(|font| Some((font, font.units_per_em()?)));
    font.ok_or_else(|| bad("font", "the built-in font cannot be read"))
}

/// Width of `text` in ems.
pub(super) fn width_em(text: &str) -> Result<f64> {
    let (font, units_per_em) = font()?;
    Ok(text.chars().map(|c| f64::from(font.h_advance_unscaled(font.glyph_id(c)) / units_per_em)).sum())
}

/// Paints `text` with its first letter at the origin, `size` pixels an em: calls `pixel` with x to the right, y down
/// from the base line, and the share of the pixel that is covered.
pub(super) fn rasterise(text: &str, size: f64, mut pixel: impl FnMut(i32, i32, f64) -> Result<()>) -> Result<()> {
    let (font, units_per_em) = font()?;
    let scale = PxScale::from(size as f32 * font.height_unscaled() / units_per_em);
    let mut x = 0.0;
    for c in text.chars() {
        let id = font.glyph_id(c);
        let glyph: Glyph = id.with_scale_and_position(scale, point(x, 0.0));
        if let Some(outline) = font.outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            let mut covered = Vec::new();
            outline.draw(|x, y, share| covered.push((x, y, share)));
            for (x, y, share) in covered.into_iter().filter(|c| c.2 > 0.0) {
                pixel(corner.x as i32 + x as i32, corner.y as i32 + y as i32, f64::from(share).min(1.0))?;
            }
        }
        x += font.h_advance_unscaled(id) / units_per_em * size as f32;
    }
    Ok(())
}

/// `text`, cut with an ellipsis where it is wider than `width` pixels at `size` pixels an em.
pub(super) fn fit(text: &str, size: f64, width: f64) -> Result<String> {
    if width_em(text)? * size <= width {
        return Ok(text.to_string());
    }
    // no letter is narrower than a fifth of an em: what lies beyond that need not be measured
    let mut kept: Vec<char> = text.chars().take((5.0 * width / size).max(0.0) as usize).collect();
    while kept.pop().is_some() {
        let shortened = format!("{}…", kept.iter().collect::<String>().trim_end());
        if width_em(&shortened)? * size <= width {
            return Ok(shortened);
        }
    }
    Ok(String::new())
}

/// `text` in lines of at most `width` pixels, broken at spaces; what does not fit into `most` lines is cut.
pub(super) fn wrap(text: &str, size: f64, width: f64, most: usize) -> Result<Vec<String>> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let full = lines.len() == most;
        if let Some(line) = lines.last_mut() {
            let longer = format!("{line} {word}");
            if full || width_em(&longer)? * size <= width {
                *line = longer;
                continue;
            }
        }
        lines.push(word.to_string());
    }
    lines.iter().map(|line| fit(line, size, width)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_the_font() {
        // DejaVu Sans: digits advance by 1303 of 2048 units, the space by 651
        assert!((width_em("0123").unwrap() - 4.0 * 1303.0 / 2048.0).abs() < 2e-3);
        assert!((width_em("1 1").unwrap() - (2.0 * 1303.0 + 651.0) / 2048.0).abs() < 2e-3);
    }

    #[test]
    fn every_symbol_of_the_axes_has_a_glyph() {
        let (font, _) = font().unwrap();
        for c in "°µτσ±√×−–·…²³⁰¹⁴⁵⁶⁷⁸⁹⁻₁₂≤≥≈∞δθφΔΣ".chars() {
            assert!(font.glyph_id(c).0 != 0, "{c}");
        }
    }

    #[test]
    fn letters_stand_on_the_base_line_within_their_width() {
        let [mut left, mut right, mut top, mut bottom] = [i32::MAX, i32::MIN, i32::MAX, i32::MIN];
        rasterise("H1", 100.0, |x, y, _| {
            (left, right, top, bottom) = (left.min(x), right.max(x), top.min(y), bottom.max(y));
            Ok(())
        })
        .unwrap();
        assert!(left > 0 && f64::from(right) < 100.0 * width_em("H1").unwrap(), "{left} {right}");
        // capitals of DejaVu Sans are 0.729 em high
        assert!((-74..=-72).contains(&top) && (-1..=0).contains(&bottom), "{top} {bottom}");
    }

    #[test]
    fn long_text_is_cut_to_its_place() {
        let long = "a very long name of a very long log ".repeat(20);
        let cut = fit(&long, 10.0, 100.0).unwrap();
        assert!(cut.ends_with('…') && width_em(&cut).unwrap() * 10.0 <= 100.0);
        let lines = wrap(&long, 10.0, 100.0, 3).unwrap();
        assert_eq!(lines.len(), 3);
        assert!(lines.iter().all(|l| width_em(l).unwrap() * 10.0 <= 100.0));
        assert_eq!(wrap("short", 10.0, 100.0, 3).unwrap(), ["short"]);
    }
}
