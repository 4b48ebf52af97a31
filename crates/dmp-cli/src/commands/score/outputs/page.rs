//! The page of `--report`.

use std::path::Path;

use anyhow::Context as _;
use dmp::Report;
use dmp_draw::{PageInput, Pictures, page};

use crate::files::save_text;

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
