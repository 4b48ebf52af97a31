//! The page of `--report`.

use std::path::Path;

use anyhow::Context as _;
use dmp::{Report, Scales};
use dmp_draw::{PageInput, Pictures, page};

use crate::save::save_text;

/// Why results judged by these lengths have no page, nor a scene: what this option makes.
pub(crate) fn no_page(option: &str, scales: Scales) -> String {
    format!("{option}: its maps and places are those of drives; it draws no {}s", scales.lengths().name)
}

/// Writes the page; tells its length in bytes.
pub(crate) fn write(
    path: &Path,
    report: &Report,
    pictures: Option<&Pictures>,
    reference: Option<&str>,
    remarks: &[String],
) -> anyhow::Result<u64> {
    let page = page(&PageInput { report, pictures, reference, remarks })
        .with_context(|| path.display().to_string())?;
    save_text(path, &page)?;
    Ok(page.len() as u64)
}
