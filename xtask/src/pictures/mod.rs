//! The pictures of the README: what the command prints on the samples, and its page.

mod terminal;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, ensure};
use clap::Args;

/// What the README's first command scores, behind `dmp`.
const SCORE: &str = "score town.mcap -t truth.tum -t drift.tum -t noise.tum -t collapsed.tum";
/// The window that shows the page twice, pixels: its beginning, and its maps.
const WINDOW: &str = "1596,924";
const TWICE: &str = "<!doctype html><style>body{margin:0;display:flex;gap:12px;background:#d5d9de;padding:12px}\
    iframe{border:0;border-radius:6px;width:780px;height:900px;background:#fff}</style>\
    <iframe src=\"page.html\" scrolling=\"no\"></iframe><iframe src=\"page.html#maps\" scrolling=\"no\"></iframe>";

/// Draw the pictures of the README in `docs/figures/`
#[derive(Debug, Args)]
pub(crate) struct PicturesArgs {
    /// Only compare: fail where the picture of the terminal differs from the command's output. (The picture of the page
    /// depends on fonts)
    #[arg(long)]
    check: bool,
    /// The command [default: the one built beside this program]
    #[arg(long)]
    binary: Option<PathBuf>,
}

pub(crate) fn run(arguments: &PicturesArgs) -> anyhow::Result<()> {
    let root = crate::workspace::root();
    let figures = root.join("docs/figures");
    let binary = crate::trials::command(arguments.binary.as_deref())?;
    let samples = root.join("data-samples");
    let printed = output(&binary, &samples, &format!("{SCORE} --quiet"))?;
    let picture = terminal::picture(&format!("dmp {SCORE}"), &String::from_utf8(printed)?);
    let kept = figures.join("terminal.svg");
    if arguments.check {
        let same = fs::read_to_string(&kept).is_ok_and(|known| known == picture);
        ensure!(same, "{} is not what the command prints: cargo xtask pictures", kept.display());
        return Ok(());
    }
    fs::write(&kept, picture).with_context(|| kept.display().to_string())?;
    let folder = tempfile::tempdir()?;
    let page = folder.path().join("page.html");
    output(&binary, &samples, &format!("{SCORE} --quiet --report {}", page.display()))?;
    let twice = folder.path().join("twice.html");
    fs::write(&twice, TWICE)?;
    screenshot(&twice, &figures.join("page.png"))?;
    println!("{}", figures.display());
    Ok(())
}

/// What the command prints.
fn output(binary: &Path, folder: &Path, words: &str) -> anyhow::Result<Vec<u8>> {
    let output = Command::new(binary)
        .args(words.split(' '))
        .env("CLICOLOR_FORCE", "1")
        .current_dir(folder)
        .output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "dmp {words}: {}", errors.trim());
    Ok(output.stdout)
}

/// A page, by a Chromium as the tests find it.
fn screenshot(page: &Path, picture: &Path) -> anyhow::Result<()> {
    let named = std::env::var_os("DMP_CHROMIUM").unwrap_or_else(|| "chromium".into());
    let mut browser = Command::new(&named);
    browser.args(["--headless", "--no-sandbox", "--hide-scrollbars", "--force-device-scale-factor=1"]);
    browser.args(["--allow-file-access-from-files", "--virtual-time-budget=5000"]);
    browser.arg(format!("--window-size={WINDOW}")).arg(format!("--screenshot={}", picture.display()));
    let output = browser.arg(format!("file://{}", page.display())).output();
    let output = output.with_context(|| format!("cannot run {}", named.display()))?;
    ensure!(output.status.success() && picture.exists(), "{}: {}", named.display(), output.status);
    Ok(())
}
