//! What is released: an archive with the command, its manual pages and completions.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, ensure};
use clap::Args;

/// Documents that go with the command.
const DOCUMENTS: [&str; 6] =
    ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "THIRD-PARTY.txt", "CITATION.cff"];
/// Shells with the names that their completions have.
const SHELLS: [(&str, &str); 3] = [("bash", "dmp.bash"), ("zsh", "_dmp"), ("fish", "dmp.fish")];

/// Pack the command for a release, as `cargo build --release` left it: an archive with manual pages and completions, which
/// `cargo deb --no-build -p dmp-cli` takes, too
#[derive(Debug, Args)]
pub(crate) struct DistArgs {
    /// The command [default: the one built beside this program]
    #[arg(long)]
    binary: Option<PathBuf>,
    /// The name of the system that it was built for
    #[arg(long, default_value_t = format!("{}-unknown-linux-gnu", std::env::consts::ARCH))]
    system: String,
    /// Where the archive is written
    #[arg(short, long, default_value = "target/dist")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &DistArgs) -> anyhow::Result<()> {
    let root = crate::workspace::root();
    let binary = crate::trials::command(arguments.binary.as_deref())?;
    let version = printed(&binary, &["--version"])?;
    let version = String::from_utf8(version)?.trim().trim_start_matches("dmp ").to_owned();
    let name = format!("dmp-{version}-{}", arguments.system);
    let folder = arguments.output.join(&name);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    for part in ["man", "completions"] {
        fs::create_dir_all(folder.join(part))?;
        // Those of this version, under a name without it.
        let latest = arguments.output.join(part);
        if latest.exists() {
            fs::remove_dir_all(&latest)?;
        }
    }
    fs::copy(&binary, folder.join("dmp"))?;
    for document in DOCUMENTS {
        fs::copy(root.join(document), folder.join(document)).with_context(|| document.to_owned())?;
    }
    printed(&binary, &["man", "-o", &folder.join("man").display().to_string()])?;
    for (shell, file) in SHELLS {
        fs::write(folder.join("completions").join(file), printed(&binary, &["completions", shell])?)?;
    }
    for part in ["man", "completions"] {
        copy_all(&folder.join(part), &arguments.output.join(part))?;
    }
    let archive = arguments.output.join(format!("{name}.tar.gz"));
    pack(&archive, &arguments.output, &name)?;
    println!("{}: {} bytes", archive.display(), fs::metadata(&archive)?.len());
    Ok(())
}

/// What a program prints.
fn printed(program: &Path, arguments: &[&str]) -> anyhow::Result<Vec<u8>> {
    let output = Command::new(program).args(arguments).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} {}: {}", program.display(), arguments.join(" "), errors.trim());
    Ok(output.stdout)
}

fn copy_all(from: &Path, to: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    Ok(())
}

/// An archive of a folder: the same bytes of the same files, whoever packs them and when.
fn pack(archive: &Path, within: &Path, folder: &str) -> anyhow::Result<()> {
    let mut tar = Command::new("tar");
    tar.args(["--sort=name", "--mtime=@0", "--owner=0", "--group=0", "--numeric-owner"]);
    tar.args(["--use-compress-program", "gzip -n9", "-cf"]).arg(archive).arg("-C").arg(within).arg(folder);
    let status = tar.status().context("cannot run tar")?;
    ensure!(status.success(), "tar: {status}");
    Ok(())
}
