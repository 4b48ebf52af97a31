//! The browser as a process: found, started and ended.

use std::cell::RefCell;
use std::fs::File;
#[cfg(unix)]
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::protocol::Connection;

/// As Chromium is called on Debian, elsewhere, and as its sibling.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

const OPTIONS: [&str; 17] = [
    "--headless",
    "--remote-debugging-pipe",
    "--no-startup-window",
    // The pages are our own, and root cannot have the sandbox.
    "--no-sandbox",
    // The same pixels everywhere.
    "--disable-gpu",
    // WebGL all the same: not every Chromium falls back on its own renderer unasked.
    "--enable-unsafe-swiftshader",
    "--force-color-profile=srgb",
    "--font-render-hinting=none",
    // The window is as wide as the test asks, without a bar at its side.
    "--hide-scrollbars",
    // Containers have little of it.
    "--disable-dev-shm-usage",
    // Nothing but the page, and no network: a page that asks for it is found out by asking.
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--no-proxy-server",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--disable-breakpad",
    "--no-first-run",
];

/// How long anything may take that a test waits for. Only a browser that hangs takes as long.
const DEADLINE: Duration = Duration::from_secs(30);

/// A Chromium without a window. It ends when this is dropped.
pub(crate) struct Browser {
    child: Child,
    pub(super) connection: RefCell<Connection>,
    /// Tabs whose page is closed, each with its session: a new one takes longer than all that is done in it.
    pub(super) tabs: RefCell<Vec<String>>,
    /// Its profile, its home and its stderr. An `Option`, so that it can be removed when the process has ended.
    folder: Option<TempDir>,
}

/// The Chromium that `DMP_CHROMIUM` names, or else the first on the search path.
fn found() -> Option<PathBuf> {
    if let Some(chosen) = std::env::var_os("DMP_CHROMIUM").map(PathBuf::from) {
        assert!(chosen.is_file(), "DMP_CHROMIUM is set, but {} does not exist", chosen.display());
        return Some(chosen);
    }
    let search_path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&search_path).collect();
    let mut places = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    places.find(|place| place.is_file())
}

impl Browser {
    /// Starts the Chromium of this system, or says that the test is skipped.
    ///
    /// # Panics
    /// Where `CI` is `true` and there is none: there a test must not pass unseen.
    pub(crate) fn start() -> Option<Self> {
        let Some(program) = found() else {
            let none = "neither chromium nor google-chrome is on the PATH, and DMP_CHROMIUM is not set";
            assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "{none}");
            println!("skipped: {none}, so no page can be looked at");
            return None;
        };
        Some(Self::of(&program))
    }

    /// Starts a program that is a Chromium.
    fn of(program: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let stderr = folder.path().join("stderr.txt");
        // The browser wants its pipes as files 3 and 4, which a shell can give it.
        let mut command = Command::new("sh");
        command
            .args(["-c", r#"exec "$@" 3<&0 4>&1 </dev/null >&2"#, "sh"])
            .arg(program)
            .args(OPTIONS)
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .env("HOME", folder.path())
            .env_remove("XDG_CONFIG_HOME")
            .env_remove("XDG_CACHE_HOME")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(File::create(&stderr).unwrap());
        // So that all its processes can be ended together.
        #[cfg(unix)]
        command.process_group(0);
        let mut child = command.spawn().unwrap();
        let (to_browser, from_browser) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let connection = RefCell::new(Connection::new(to_browser, from_browser, stderr, DEADLINE));
        let tabs = RefCell::default();
        let browser = Self { child, connection, tabs, folder: Some(folder) };
        // Answered as soon as it runs.
        browser.call("", "Browser.getVersion", &json!({}));
        browser
    }

    /// Sends a command to a page, or to the browser where `session` is empty, and waits for its answer.
    pub(super) fn call(&self, session: &str, method: &str, parameters: &Value) -> Value {
        self.connection.borrow_mut().call(session, method, parameters)
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let group = format!("kill -KILL -{}", self.child.id());
        let _ = Command::new("sh").args(["-c", &group]).status();
        let _ = self.child.kill();
        let _ = self.child.wait();
        // The browser's other processes end a moment later, and may still write.
        if let Some(folder) = self.folder.take() {
            for _ in 0..100 {
                if std::fs::remove_dir_all(folder.path()).is_ok() {
                    return;
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
}
