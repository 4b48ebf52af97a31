//! What makes the page a place to explore: its contents, its data, and the script.

use dmp_report::Report;

use crate::plot::escape;

/// The script. Without it the page says the same.
pub(super) const SCRIPT: &str = include_str!("assets/explore.js");
/// The only script that the page may run, by its SHA-256: `openssl dgst -sha256 -binary explore.js | base64`.
pub(super) const SCRIPT_HASH: &str = "sha256-eVCig0eMS1622PszYeDMYVhFpj2vkZ+C5QVTiv5KK04=";

/// Links to the sections of a page.
pub(super) fn contents(main: &str) -> String {
    let heads = main.split("<h2 id=\"").skip(1).filter_map(|rest| {
        let (id, rest) = rest.split_once("\">")?;
        let (title, _) = rest.split_once("</h2>")?;
        Some(format!("<li><a href=\"#{id}\">{title}</a></li>\n"))
    });
    format!(
        "<nav aria-label=\"Contents\">\n<ul>\n<li><details><summary>Contents</summary>\n<ul>\n{}</ul>\n</details></li>\n</ul>\n</nav>\n",
        heads.collect::<String>()
    )
}

/// All numbers, as `dmp score --json` has them.
pub(super) fn data(report: &Report) -> String {
    // What is not finite is null there; nothing else can fail.
    let json = serde_json::to_string(report).unwrap_or_default();
    // A name cannot end the element.
    let json = json.replace('<', "\\u003c");
    format!("<script type=\"application/json\" id=\"dmp-report\">{json}</script>\n")
}

/// What a picture says of the metres of a map: see the script.
pub(super) fn with_data(svg: &str, name: &str, value: &str) -> String {
    svg.replacen("<svg ", &format!("<svg data-{name}=\"{}\" ", escape(value)), 1)
}

/// A picture that links lead to.
pub(super) fn with_id(svg: &str, id: &str) -> String {
    svg.replacen("<svg ", &format!("<svg id=\"{id}\" "), 1)
}
