//! Files that are written: logs, residuals, scenes.

mod depth;
mod folder;
mod kept;
mod mcap;
mod residuals;
mod scene;

pub use depth::{DepthFolderWriter, encode_depth_png};
pub use folder::{FolderFormat, FolderScanWriter};
pub use kept::{KeptPart, KeptReader, KeptWriter, RETURN_BYTES, is_kept};
pub use mcap::{McapScanWriter, McapWriterOptions};
pub use residuals::{ResidualFormat, ResidualHead, ResidualWriter, ScoredPoint, ScoredScan};
pub use scene::{SceneCloud, SceneHead, ScenePlace, ScenePoint, SceneRun, SceneWriter};
