//! A page in the browser: opened at a width and in a theme, read and photographed.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use super::Browser;

/// What the reader's system prefers: `prefers-color-scheme`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Theme {
    Light,
    Dark,
}

/// The height of the window. A page that is higher goes on below it.
const HEIGHT_PX: u32 = 900;

/// An open page. Its tab is used again when this is dropped.
pub(crate) struct Page<'a> {
    browser: &'a Browser,
    session: String,
    url: String,
}

/// The `file:` URL of a path, everything but letters, digits and a few marks escaped.
fn file_url(path: &Path) -> String {
    let path = std::fs::canonicalize(path).unwrap();
    let mut url = "file://".to_owned();
    for byte in path.as_os_str().as_encoded_bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~".contains(byte) {
            url.push(char::from(*byte));
        } else {
            write!(url, "%{byte:02X}").unwrap();
        }
    }
    url
}

impl Browser {
    /// A new tab's session, which reports what happens in it.
    fn new_tab(&self) -> String {
        let target = self.call("", "Target.createTarget", &json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let answer = self.call("", "Target.attachToTarget", &attach);
        let session = answer["sessionId"].as_str().unwrap().to_owned();
        for domain in ["Page", "Network", "Runtime", "Log"] {
            self.call(&session, &format!("{domain}.enable"), &json!({}));
        }
        self.call(&session, "Page.setLifecycleEventsEnabled", &json!({ "enabled": true }));
        session
    }

    /// Opens a file in a window of this width, 900 px high with one pixel for each px, and waits until
    /// everything in it is loaded and decoded.
    pub(crate) fn open(&self, path: &Path, width_px: u32, theme: Theme) -> Page<'_> {
        let idle = self.tabs.borrow_mut().pop();
        let session = idle.unwrap_or_else(|| self.new_tab());
        let page = Page { browser: self, session, url: file_url(path) };
        let metrics = json!({
            "width": width_px, "height": HEIGHT_PX, "deviceScaleFactor": 1, "mobile": false
        });
        page.call("Emulation.setDeviceMetricsOverride", &metrics);
        let scheme = if theme == Theme::Dark { "dark" } else { "light" };
        let feature = json!({ "name": "prefers-color-scheme", "value": scheme });
        page.call("Emulation.setEmulatedMedia", &json!({ "features": [feature] }));
        // What was in the tab before has nothing more to say when an empty page is in its place.
        page.navigate("about:blank");
        page.navigate(&page.url);
        page.evaluate(include_str!("layout/settle.js"));
        page
    }
}

impl Page<'_> {
    pub(super) fn call(&self, method: &str, parameters: &Value) -> Value {
        self.browser.call(&self.session, method, parameters)
    }

    /// Goes to an address, forgets the events before, and waits until all of it is loaded.
    fn navigate(&self, url: &str) {
        let mut connection = self.browser.connection.borrow_mut();
        connection.events.retain(|event| event.session != self.session);
        let answer = connection.call(&self.session, "Page.navigate", &json!({ "url": url }));
        assert!(answer["errorText"].is_null(), "{url}: {}", answer["errorText"]);
        // By its number: what was in the tab before is loaded at some time as well.
        connection.wait_for(&format!("{url} to be loaded"), |event| {
            event.method == "Page.lifecycleEvent"
                && event.parameters["loaderId"] == answer["loaderId"]
                && event.parameters["name"] == "load"
        });
    }

    /// The value of a JavaScript expression in the page; that of a promise once it is kept.
    ///
    /// # Panics
    /// If the expression throws.
    pub(crate) fn evaluate(&self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let mut answer = self.call("Runtime.evaluate", &parameters);
        let thrown = &answer["exceptionDetails"];
        assert!(thrown.is_null(), "{}\nis thrown by {expression}", thrown["exception"]["description"]);
        answer["result"]["value"].take()
    }

    /// The visible text of the page, as it would be copied.
    pub(crate) fn text(&self) -> String {
        self.evaluate("document.body.innerText").as_str().unwrap().to_owned()
    }

    /// The colour of what lies below everything, red, green and blue.
    pub(crate) fn ground(&self) -> String {
        let painted = "[document.body, document.documentElement].map(part => getComputedStyle(part).backgroundColor)\
                       .find(colour => colour !== 'rgba(0, 0, 0, 0)')";
        self.evaluate(painted).as_str().unwrap().to_owned()
    }

    /// Opens every `<details>`, as a reader does who wants to see it all.
    pub(crate) fn unfold(&self) {
        self.evaluate("document.querySelectorAll('details').forEach(details => { details.open = true; })");
    }

    /// What `of` makes of the events until now.
    fn events<T>(&self, of: impl Fn(&str, &Value) -> Option<T>) -> Vec<T> {
        // What came before an answer has been read with it.
        self.evaluate("0");
        let connection = self.browser.connection.borrow();
        let events = connection.events.iter().filter(|event| event.session == self.session);
        events.filter_map(|event| of(&event.method, &event.parameters)).collect()
    }

    /// The addresses that the page has asked for beside its own: of the network and of other files. A page
    /// that is whole in itself has none.
    pub(crate) fn requests(&self) -> Vec<String> {
        self.events(|method, parameters| {
            let url = parameters["request"]["url"].as_str()?;
            let foreign = !url.starts_with("data:") && url != self.url;
            (method == "Network.requestWillBeSent" && foreign).then(|| url.to_owned())
        })
    }

    /// What a developer would see in red: exceptions, errors logged by scripts and by the browser.
    pub(crate) fn errors(&self) -> Vec<String> {
        let text = |value: &Value| value.as_str().map(str::to_owned);
        self.events(|method, parameters| match method {
            "Runtime.exceptionThrown" => {
                let details = &parameters["exceptionDetails"];
                text(&details["exception"]["description"]).or_else(|| text(&details["text"]))
            }
            "Runtime.consoleAPICalled" if parameters["type"] == "error" || parameters["type"] == "assert" => {
                Some(parameters["args"].as_array()?.iter().map(said).collect::<Vec<_>>().join(" "))
            }
            "Log.entryAdded" if parameters["entry"]["level"] == "error" => {
                let entry = &parameters["entry"];
                Some(format!("{} {}", said(&entry["text"]), said(&entry["url"])))
            }
            _ => None,
        })
    }
}

/// A value as the console shows it.
fn said(value: &Value) -> String {
    let value = if value.is_object() {
        if value["value"].is_null() { &value["description"] } else { &value["value"] }
    } else {
        value
    };
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

impl Drop for Page<'_> {
    fn drop(&mut self) {
        self.browser.tabs.borrow_mut().push(std::mem::take(&mut self.session));
    }
}
