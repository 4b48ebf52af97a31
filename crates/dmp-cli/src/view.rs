//! `--view`: a page that was written, opened in the browser.

use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;

use crate::host::Hosted;
use crate::say::say;

/// How long a program is waited for that may find nothing to open the page with. One that goes on has opened it.
const WAIT: Duration = Duration::from_secs(3);
/// How long to wait before it is asked again.
const ASK_AFTER: Duration = Duration::from_millis(20);

/// Programs that open a page with whatever the user opens pages with, and what they are called with before the page.
#[cfg(target_os = "macos")]
const OPENERS: &[(&str, &[&str])] = &[("open", &[])];
#[cfg(windows)]
const OPENERS: &[(&str, &[&str])] = &[("explorer", &[])];
#[cfg(not(any(target_os = "macos", windows)))]
const OPENERS: &[(&str, &[&str])] = &[("xdg-open", &[]), ("gio", &["open"]), ("wslview", &[])];

/// Looking at a page.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// Open the page of --report in the browser: that of `BROWSER`, else the one that this system opens pages with
    #[arg(long, requires = "report", help_heading = "Output")]
    view: bool,
}

impl ViewArgs {
    /// Opens a page, where that is asked for.
    pub(crate) fn open(&self, page: Option<&Path>, host: &Hosted) {
        if let Some(page) = page.filter(|_| self.view) {
            open(page, host);
        }
    }
}

/// Opens a page. Where nothing opens it, a line says so: it is there all the same.
pub(crate) fn open(page: &Path, host: &Hosted) {
    let chosen = std::env::var_os("BROWSER").unwrap_or_default();
    let is_opened = page.is_file()
        && std::path::absolute(page).is_ok_and(|page| calls(&chosen, &page).iter().any(|words| opens(words)));
    if !is_opened {
        say!(host, "note: {}: nothing here opens it for --view: open it in a browser", page.display());
    }
}

/// What is tried, the first first: what `BROWSER` names, commands with colons between them in which `%s` is the page, as other
/// programs read it; then what opens pages on this system.
fn calls(chosen: &OsStr, page: &Path) -> Vec<Vec<OsString>> {
    let of_user = |command: &str| {
        let mut words: Vec<OsString> = command
            .split_whitespace()
            .map(|word| if word == "%s" { page.into() } else { word.into() })
            .collect();
        if !command.split_whitespace().any(|word| word == "%s") {
            words.push(page.into());
        }
        words
    };
    let chosen = chosen.to_string_lossy();
    let by_user =
        std::env::split_paths(chosen.as_ref()).map(|command| command.to_string_lossy().into_owned());
    let by_user = by_user.filter(|command| !command.trim().is_empty()).map(|command| of_user(&command));
    let by_system = OPENERS.iter().map(|(program, before)| {
        let words = std::iter::once(program).chain(*before).map(OsString::from);
        words.chain([page.into()]).collect()
    });
    by_user.chain(by_system).collect()
}

/// Whether a program takes the page.
fn opens(words: &[OsString]) -> bool {
    let [program, rest @ ..] = words else { return false };
    let mut command = Command::new(program);
    command.args(rest).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    #[cfg(unix)]
    {
        // An interrupt in the terminal is none of the browser.
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
    }
    let Ok(mut started) = command.spawn() else { return false };
    let until = Instant::now() + WAIT;
    while Instant::now() < until {
        match started.try_wait() {
            // That of Windows never says that it succeeded.
            Ok(Some(status)) => return status.success() || cfg!(windows),
            Ok(None) => thread::sleep(ASK_AFTER),
            Err(_) => return false,
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_user_names_comes_first() {
        let page = Path::new("/a b/page.html");
        let told = |chosen: &str| -> Vec<String> {
            let words = calls(OsStr::new(chosen), page).into_iter();
            words.map(|words| words.join(OsStr::new("|")).to_string_lossy().into_owned()).collect()
        };
        let by_system = told("");
        assert!(!by_system.is_empty() && by_system.iter().all(|call| call.ends_with("|/a b/page.html")));
        if cfg!(unix) {
            let found = told("firefox -P work: :lynx %s -x");
            let expected = ["firefox|-P|work|/a b/page.html", "lynx|/a b/page.html|-x"];
            assert_eq!(found[..2], expected);
            assert_eq!(found[2..], by_system);
        }
    }
}
