//! The formats in which the texels of lightmaps are stored, in files and on the GPU. What each can hold is in
//! `lightmap_files::encoding_range`.

/// Storage format of a lightmap's texels. All formats are unsigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum LightmapEncoding {
    /// f32 per channel.
    Rgb32Float,
    /// f16 per channel: 11 significant bits; largest value 65504.
    #[default]
    Rgb16Float,
    /// RGB9E5: 9-bit mantissas with a shared exponent; largest value 65408.
    Rgb9E5,
}

impl LightmapEncoding {
    /// Every format, the most accurate first.
    pub const ALL: &'static [Self] = &[Self::Rgb32Float, Self::Rgb16Float, Self::Rgb9E5];

    /// The name in files and on the command line: `rgb32f`, `rgb16f` or `rgb9e5`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgb32Float => "rgb32f",
            Self::Rgb16Float => "rgb16f",
            Self::Rgb9E5 => "rgb9e5",
        }
    }

    /// The format with this name, or `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|format| format.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_has_its_name() {
        for format in LightmapEncoding::ALL {
            assert_eq!(LightmapEncoding::from_name(format.name()), Some(*format));
        }
        assert_eq!(LightmapEncoding::from_name("rgb8"), None);
    }
}
