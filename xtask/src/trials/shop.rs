//! Makes the files of seeds, by the command itself, in a folder of its own.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context as _, ensure};

use super::damage::others;
use super::files::paths;
use super::{File, Form, write};

/// What seeds are made of, the first of several. Few returns: a command on them takes some hundredths of a second.
const MADE: [&str; 6] = [
    "simulate town -o t.mcap --truth t.tum --truth-rate 4 --seed 1 --scans 16 --rate 2 --speed 7 --beams 8 \
     --elevation=-14,6 --azimuth-steps 48 --max-range 60 --resolution 0.0625",
    // Scans enough for a quick score.
    "simulate town -o r.mcap --truth r.tum --truth-rate 2 --seed 1 --scans 400 --rate 10 --speed 7 --beams 4 \
     --elevation=-14,6 --azimuth-steps 12 --max-range 60 --resolution 0.0625",
    // A drive long enough for loops.
    "simulate town -o q.mcap --truth q.tum --truth-rate 2 --seed 1 --scans 40 --rate 1 --speed 15 --beams 4 \
     --elevation=-14,6 --azimuth-steps 36 --max-range 60 --resolution 0.0625",
    "simulate room -o room --size 40x30 --frames 8 --rate 1",
    "simulate loops q.tum -o loops --spacing 3 --true 1 --false 0 --near 0",
    "map build t.mcap -t t.tum -o map.dmpmap",
];

/// Where seeds are made.
#[derive(Debug)]
pub(crate) struct Shop<'a> {
    dmp: &'a Path,
    folder: tempfile::TempDir,
}

impl<'a> Shop<'a> {
    /// With the files of other software in the folder `others`.
    pub(crate) fn open(dmp: &'a Path) -> anyhow::Result<Self> {
        let shop = Self { dmp, folder: tempfile::tempdir()? };
        for folder in ["mcap", "rosbag1", "rosbag2", "clouds", "mesh", "trajectories"] {
            let from = crate::workspace::root().join("tests/conformance").join(folder);
            for path in paths(&from) {
                let bytes = fs::read(from.join(&path))?;
                shop.put(File { path: format!("others/{folder}/{path}"), bytes, form: None })?;
            }
        }
        MADE.iter().try_for_each(|line| shop.make(line).map(drop))?;
        Ok(shop)
    }

    /// Runs a command; returns what it prints.
    pub(crate) fn make(&self, line: &str) -> anyhow::Result<Vec<u8>> {
        let mut command = Command::new(self.dmp);
        command.args(line.split_whitespace()).current_dir(self.folder.path()).stdin(Stdio::null());
        let output = command.output()?;
        let stderr = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "making seeds: dmp {line}: {}: {stderr}", output.status);
        Ok(output.stdout)
    }

    /// Puts a file into the folder.
    pub(crate) fn put(&self, file: File) -> anyhow::Result<()> {
        write(&[file], self.folder.path())
    }

    pub(crate) fn read(&self, path: &str) -> anyhow::Result<Vec<u8>> {
        fs::read(self.folder.path().join(path)).with_context(|| format!("a seed's {path}"))
    }

    /// What a word of the table stands for: `@PATTERN` for the paths of files of other software, all else for itself.
    pub(crate) fn each(word: &str) -> anyhow::Result<Vec<String>> {
        let Some(pattern) = word.strip_prefix('@') else { return Ok(vec![word.to_owned()]) };
        let found = others(pattern).with_context(|| pattern.to_owned())?;
        Ok(found.into_iter().map(|(path, _)| format!("others/{path}")).collect())
    }

    /// Files by a list of `PATH[=NEW PATH][:]`: with a colon they are damaged, in the form of their ending. A path that ends in
    /// `/` is a folder; of it the first two files with each ending are damaged, as one scan is like the next.
    pub(crate) fn files(&self, list: &str) -> anyhow::Result<Vec<File>> {
        let mut files = Vec::new();
        for word in list.split_whitespace() {
            let (word, is_damaged) = word.strip_suffix(':').map_or((word, false), |word| (word, true));
            let (path, name) = word.split_once('=').unwrap_or((word, word));
            if !path.ends_with('/') {
                let form = is_damaged.then(|| form(name));
                files.push(File { path: name.to_owned(), bytes: self.read(path)?, form });
                continue;
            }
            let mut damaged = Vec::new();
            for inner in paths(&self.folder.path().join(path)) {
                let form = form(&inner);
                let before = damaged.iter().filter(|other| **other == form).count();
                let wanted = is_damaged && (before < 2 || form == Form::Text);
                damaged.extend(wanted.then_some(form));
                let bytes = self.read(&format!("{path}{inner}"))?;
                files.push(File { path: format!("{name}{inner}"), bytes, form: wanted.then_some(form) });
            }
        }
        Ok(files)
    }
}

/// By the ending of its name.
fn form(name: &str) -> Form {
    match name.rsplit('.').next().unwrap_or_default() {
        "mcap" => Form::Mcap,
        "db3" => Form::Sqlite,
        "pcd" | "ply" | "npy" => Form::Headed,
        "las" | "laz" => Form::Las,
        "json" => Form::Json,
        "png" => Form::Png,
        "dmpmap" => Form::Store,
        "bag" | "bin" | "f32" => Form::Bytes,
        _ => Form::Text,
    }
}
