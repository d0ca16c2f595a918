//! A finished page, ready to be written.

use super::Panel;
use super::scene::Scene;
use crate::error::{Error, ErrorKind, Result};
use crate::files::{OutputFile, mark};
use std::path::Path;

/// File formats of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Format {
    /// Scalable, its text can be searched.
    Svg,
    /// Pixels.
    Png,
}

impl Format {
    /// The format that the ending of `path` asks for.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if it is neither `.svg` nor `.png`.
    pub(crate) fn of(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::new(ErrorKind::Usage, path.display(), "is not the name of a picture that can be written")
                .hint("let the name end in .svg or .png")),
        }
    }
}

/// A drawn page.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub(super) scene: Scene,
    pub(super) title: String,
    /// Panels that were drawn, row by row.
    pub(in crate::report) panels: Vec<Panel>,
}

impl Picture {
    /// Its title.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Width and height, pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.scene.width, self.scene.height)
    }

    /// The picture as an SVG document.
    ///
    /// # Errors
    /// [`ErrorKind::Numeric`] if the drawing library refuses.
    pub fn svg(&self) -> Result<String> {
        self.scene.svg(&self.title)
    }

    /// The picture as the bytes of a PNG file, 8 bits a channel.
    ///
    /// # Errors
    /// [`ErrorKind::Numeric`] if the drawing library refuses.
    pub fn png(&self) -> Result<Vec<u8>> {
        let cannot = |e: png::EncodingError| Error::new(ErrorKind::Numeric, "figure", e);
        let rgb = self.scene.rgb()?;
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.scene.width, self.scene.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Default);
        encoder.set_adaptive_filter(png::AdaptiveFilterType::Adaptive);
        let (keyword, text) = mark::png();
        encoder.add_text_chunk(keyword, text).map_err(cannot)?;
        let mut writer = encoder.write_header().map_err(cannot)?;
        writer.write_image_data(&rgb).map_err(cannot)?;
        writer.finish().map_err(cannot)?;
        Ok(bytes)
    }

    /// Writes the picture into `file`, which was claimed before the work began.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if the name of `file` ends in neither `.svg` nor `.png`, [`ErrorKind::Io`] if the disk
    /// refuses, [`ErrorKind::Numeric`] if the drawing library does.
    pub fn write(&self, mut file: OutputFile) -> Result<()> {
        match Format::of(file.target())? {
            Format::Svg => file.write_all(self.svg()?.as_bytes())?,
            Format::Png => file.write_all(&self.png()?)?,
        }
        file.commit()
    }
}
