//! HTML pages as a reader meets them: in a real Chromium, without a window.
//!
//! ```text
//! let Some(browser) = Browser::start() else { return };
//! let page = browser.open(&path, 800, Theme::Dark);
//! assert!(page.has("heading", "Runs"));
//! page.assert_sound();
//! ```
//!
//! What a check looks at runs in the page as JavaScript of the test (`layout/`); the page itself needs none.
//! Chromium is driven by its DevTools protocol over two pipes: a crate for it would bring more than a hundred
//! others, and fetch the protocol's description while it is built.

mod accessible;
mod chromium;
mod layout;
mod page;
mod protocol;
mod tests;

pub(crate) use chromium::Browser;
use page::Page;
pub(crate) use page::Theme;
