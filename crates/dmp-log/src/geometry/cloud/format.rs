//! The formats of clouds.

/// The formats of clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CloudFormat {
    /// LAS.
    Las,
    /// Compressed LAS.
    Laz,
    /// PLY with a `vertex` element.
    Ply,
    /// PCD.
    Pcd,
    /// E57: read only.
    E57,
}

impl CloudFormat {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Las => "LAS",
            Self::Laz => "LAZ",
            Self::Ply => "PLY",
            Self::Pcd => "PCD",
            Self::E57 => "E57",
        }
    }
}
