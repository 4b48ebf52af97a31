//! The DevTools protocol over two pipes: JSON both ways, with a zero byte behind each message.

use std::io::{BufRead as _, BufReader, Read, Write};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// What the browser says of its own accord.
#[derive(Debug)]
pub(super) struct Event {
    /// Of which page; empty for the browser's own.
    pub(super) session: String,
    pub(super) method: String,
    pub(super) parameters: Value,
}

/// Both pipes, and what came through them unasked.
pub(super) struct Connection {
    to_browser: Box<dyn Write>,
    messages: Receiver<Value>,
    pub(super) events: Vec<Event>,
    calls: u64,
    /// How long anything may take that is waited for.
    deadline: Duration,
    /// What the browser says on stderr, for the message of a test that fails.
    stderr: PathBuf,
}

impl Connection {
    pub(super) fn new(
        to_browser: impl Write + 'static,
        from_browser: impl Read + Send + 'static,
        stderr: PathBuf,
        deadline: Duration,
    ) -> Self {
        let (sender, messages) = channel();
        // A read from a pipe cannot have a deadline; waiting for another thread can.
        std::thread::spawn(move || {
            let mut from_browser = BufReader::new(from_browser);
            let mut bytes = Vec::new();
            while matches!(from_browser.read_until(0, &mut bytes), Ok(1..)) {
                bytes.pop();
                let Ok(message) = serde_json::from_slice(&bytes) else { return };
                if sender.send(message).is_err() {
                    return;
                }
                bytes.clear();
            }
        });
        Self { to_browser: Box::new(to_browser), messages, events: Vec::new(), calls: 0, deadline, stderr }
    }

    /// Sends a command to a page, or to the browser where `session` is empty, and says its number.
    fn send(&mut self, session: &str, method: &str, parameters: &Value) -> std::io::Result<u64> {
        self.calls += 1;
        let mut message = json!({ "id": self.calls, "method": method, "params": parameters });
        if !session.is_empty() {
            message["sessionId"] = session.into();
        }
        let mut bytes = serde_json::to_vec(&message)?;
        bytes.push(0);
        self.to_browser.write_all(&bytes)?;
        self.to_browser.flush()?;
        Ok(self.calls)
    }

    /// Sends a command and waits for its answer.
    pub(super) fn call(&mut self, session: &str, method: &str, parameters: &Value) -> Value {
        let what = format!("the answer to `{method}`");
        let sent = self.send(session, method, parameters);
        let number = sent.unwrap_or_else(|error| panic!("no {what}: {error}\n{}", self.last_words()));
        let until = Instant::now() + self.deadline;
        loop {
            let mut message = self.next(&what, until);
            if message["id"] == number {
                let error = &message["error"];
                assert!(error.is_null(), "chromium refuses `{method}`: {error}");
                return message["result"].take();
            }
        }
    }

    /// Waits for an event, unless it is there already.
    pub(super) fn wait_for(&mut self, what: &str, is_it: impl Fn(&Event) -> bool) {
        let until = Instant::now() + self.deadline;
        while !self.events.iter().any(&is_it) {
            self.next(what, until);
        }
    }

    /// The next message; an event is kept as well.
    fn next(&mut self, what: &str, until: Instant) -> Value {
        let left = until.saturating_duration_since(Instant::now());
        let mut message = match self.messages.recv_timeout(left) {
            Ok(message) => message,
            Err(RecvTimeoutError::Timeout) => {
                panic!("waited {:?} for {what}\n{}", self.deadline, self.last_words())
            }
            Err(RecvTimeoutError::Disconnected) => {
                panic!("chromium ended; waited for {what}\n{}", self.last_words())
            }
        };
        let method = message["method"].as_str().unwrap_or_default().to_owned();
        assert!(method != "Inspector.targetCrashed", "the page crashed; waited for {what}");
        if !method.is_empty() {
            let session = message["sessionId"].as_str().unwrap_or_default().to_owned();
            self.events.push(Event { session, method, parameters: message["params"].take() });
        }
        message
    }

    /// The end of what the browser has said on stderr.
    fn last_words(&self) -> String {
        let said = std::fs::read(&self.stderr).unwrap_or_default();
        let said = String::from_utf8_lossy(&said);
        let lines: Vec<&str> = said.lines().collect();
        format!("stderr of chromium ends in:\n{}", lines[lines.len().saturating_sub(10)..].join("\n"))
    }
}
