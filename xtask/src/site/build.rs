//! The book: a copy of `docs/` in which no link leaves it, with the generated pages, built by mdbook.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, bail};

use super::generated::{self, GENERATED};
use super::{check, markdown};

/// Writes the site into `target/site`.
///
/// # Errors
/// Where mdbook is not there or fails, and where a file cannot be read or written.
pub(super) fn build(root: &Path) -> anyhow::Result<()> {
    let target = root.canonicalize().context("the repository has no path")?.join("target");
    let source = target.join("site-source");
    let site = target.join("site");
    // Pages that are gone must not stay.
    for folder in [&source, &site] {
        if folder.exists() {
            fs::remove_dir_all(folder).with_context(|| format!("{}: cannot remove", folder.display()))?;
        }
    }
    copy(root, Path::new("docs"), &source)?;
    for (name, text) in GENERATED.iter().zip(generated::pages(root)?) {
        let path = source.join(name.trim_start_matches("docs/"));
        fs::write(&path, text).with_context(|| format!("{}: cannot write", path.display()))?;
    }
    let done = Command::new("mdbook").arg("build").arg(&source).arg("--dest-dir").arg(&site).status();
    match done {
        Ok(status) if status.success() => {
            println!("{}", site.join("index.html").display());
            Ok(())
        }
        Ok(status) => bail!("mdbook: {status}"),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            bail!("mdbook is not on the PATH: `cargo install mdbook --locked` puts it there")
        }
        Err(error) => Err(error).context("mdbook cannot be started"),
    }
}

/// Copies a folder of the repository and all below it; pages with the links that a site can have.
fn copy(root: &Path, folder: &Path, to: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(to).with_context(|| format!("{}: cannot make", to.display()))?;
    let listed =
        fs::read_dir(root.join(folder)).with_context(|| format!("{}: cannot list", folder.display()))?;
    for entry in listed {
        let entry = entry.with_context(|| format!("{}: cannot list", folder.display()))?;
        let (name, to) = (folder.join(entry.file_name()), to.join(entry.file_name()));
        let failed = || format!("{}: cannot copy", name.display());
        if entry.path().is_dir() {
            copy(root, &name, &to)?;
        } else if name.extension().is_some_and(|extension| extension == "md") {
            let text = fs::read_to_string(entry.path()).with_context(failed)?;
            fs::write(to, within(&name, &text)).with_context(failed)?;
        } else {
            fs::copy(entry.path(), to).with_context(failed)?;
        }
    }
    Ok(())
}

/// A page whose links to other parts of the repository are the names of these, as a site has only `docs/`.
fn within(page: &Path, text: &str) -> String {
    let prose = markdown::without_code(text);
    let mut within = String::with_capacity(text.len());
    let mut at = 0;
    for (link, bytes) in markdown::links(&prose) {
        let Some((Some(file), _)) = check::target(page, &link.target) else { continue };
        if file.starts_with("docs") || bytes.start < at {
            continue;
        }
        let shown = &text[bytes.start + 1..bytes.end];
        let shown = shown.rsplit_once("](").map_or(shown, |(shown, _)| shown);
        within.push_str(&text[at..bytes.start]);
        within.push_str(shown);
        let named = format!(" (`{}` in the repository)", file.display());
        within.push_str(&named);
        at = bytes.end;
    }
    within.push_str(&text[at..]);
    within
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_out_of_the_docs_become_names() {
        let text = "See [deploy](../deploy/README.md#slurm), [a](a.md) and `[x](../x.md)`;\n[w](https://w.org) ends [py](../python).";
        let expected = "See deploy (`deploy/README.md` in the repository), [a](a.md) and `[x](../x.md)`;\n\
                        [w](https://w.org) ends py (`python` in the repository).";
        assert_eq!(within(Path::new("docs/b.md"), text), expected);
        assert_eq!(within(Path::new("docs/guide/b.md"), "[a](../a.md#x)"), "[a](../a.md#x)");
    }

    #[test]
    fn a_copy_has_pages_and_pictures() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::create_dir_all(root.join("docs/figures")).unwrap();
        fs::write(root.join("docs/a.md"), "[r](../README.md)").unwrap();
        fs::write(root.join("docs/figures/f.svg"), "<svg/>").unwrap();
        copy(root, Path::new("docs"), &root.join("copy")).unwrap();
        assert_eq!(fs::read_to_string(root.join("copy/a.md")).unwrap(), "r (`README.md` in the repository)");
        assert_eq!(fs::read_to_string(root.join("copy/figures/f.svg")).unwrap(), "<svg/>");
    }
}
