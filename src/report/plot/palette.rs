//! Colours that readers with a colour vision deficiency can tell apart (Okabe and Ito 2008), and strokes.

/// An sRGB colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Color(pub u8, pub u8, pub u8);

/// Text and the first line.
pub(crate) const BLACK: Color = Color(0x1A, 0x1A, 0x1A);
/// Measured values.
pub(crate) const BLUE: Color = Color(0x00, 0x72, 0xB2);
/// Fitted values.
pub(crate) const VERMILION: Color = Color(0xD5, 0x5E, 0x00);
/// A third series.
pub(crate) const GREEN: Color = Color(0x00, 0x9E, 0x73);
/// A fourth series.
pub(crate) const PURPLE: Color = Color(0xCC, 0x79, 0xA7);
/// A fifth series.
pub(crate) const ORANGE: Color = Color(0xE6, 0x9F, 0x00);
/// Raw samples under their means.
pub(crate) const SKY: Color = Color(0x56, 0xB4, 0xE9);
/// Bounds and bands.
pub(crate) const GREY: Color = Color(0x80, 0x80, 0x80);
/// The simulator as it was, and with the effects that were found.
pub(in crate::report) const BEFORE: Color = GREY;
pub(in crate::report) const AFTER: Color = VERMILION;
/// Paper.
pub(crate) const WHITE: Color = Color(0xFF, 0xFF, 0xFF);

/// Colours of series that have no meaning of their own, in order.
pub(crate) const SERIES: [Color; 6] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, BLACK];

/// The colour of series `i`, over and over.
#[must_use]
pub(crate) fn series(i: usize) -> Color {
    SERIES[i % SERIES.len()]
}

impl Color {
    /// The colour thinned with white: 0 is white, 1 the colour itself.
    #[must_use]
    pub(crate) fn tint(self, share: f64) -> Self {
        WHITE.towards(self, share)
    }

    /// A colour between this one (0) and `other` (1).
    #[must_use]
    pub(crate) fn towards(self, other: Self, share: f64) -> Self {
        let share = share.clamp(0.0, 1.0);
        let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
        Self(mix(self.0, other.0), mix(self.1, other.1), mix(self.2, other.2))
    }

    /// Perceived lightness from 0 (black) to 1 (white): Rec. 709 luma.
    #[must_use]
    pub(crate) fn lightness(self) -> f64 {
        (0.2126 * f64::from(self.0) + 0.7152 * f64::from(self.1) + 0.0722 * f64::from(self.2)) / 255.0
    }

    /// An unbroken stroke, `width` in pixels.
    #[must_use]
    pub(crate) fn stroke(self, width: f64) -> Stroke {
        Stroke { color: self, width, dash: None }
    }
}

/// How a line is drawn. Lengths are pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    /// Colour.
    pub color: Color,
    /// Width.
    pub width: f64,
    /// Lengths of dash and gap.
    pub dash: Option<[f64; 2]>,
}

impl Stroke {
    /// The same stroke, dashed.
    #[must_use]
    pub(crate) fn dashed(self) -> Self {
        Self { dash: Some([9.0, 6.0]), ..self }
    }
}
