//! Pieces of a page.

use crate::plot::escape;
use crate::text::NONE;

const STYLE: &str = include_str!("assets/style.css");

/// A whole page: one file that needs nothing else, light or dark as its reader likes. Its parts are elements, but for the title.
pub(super) struct Document<'a> {
    pub(super) version: &'a str,
    pub(super) title: &'a str,
    /// What the page may load beside its styles, as a policy of content security: `img-src data:;`.
    pub(super) policy: &'a str,
    /// Below the title.
    pub(super) lead: &'a str,
    /// Between head and body.
    pub(super) contents: &'a str,
    pub(super) main: &'a str,
    pub(super) footer: &'a str,
    pub(super) scripts: &'a str,
}

impl Document<'_> {
    pub(super) fn to_html(&self) -> String {
        let Self { policy, lead, contents, main, footer, scripts, .. } = self;
        let [version, title] = [self.version, self.title].map(escape);
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\">\n<meta http-equiv=\"Content-Security-Policy\" \
             content=\"default-src 'none'; {policy}style-src 'unsafe-inline'\">\n<meta name=\"generator\" \
             content=\"dmp {version}\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
             <header><h1>{title}</h1>\n{lead}</header>\n{contents}<main>\n{main}</main>\n<footer>\n{}</footer>\n\
             {scripts}</body>\n</html>\n",
            paragraph(footer)
        )
    }
}

/// A section with a heading; nothing where there is nothing in it.
pub(super) fn section(id: &str, heading: &str, body: &str) -> String {
    if body.is_empty() {
        return String::new();
    }
    format!(
        "<section aria-labelledby=\"{id}\">\n<h2 id=\"{id}\">{}</h2>\n{body}</section>\n",
        escape(heading)
    )
}

/// Elements of a list, as HTML, between tags that open and close it; nothing where there are none.
pub(super) fn list(open: &str, items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().map(|item| format!("<li>{item}</li>\n")).collect();
    if items.is_empty() { String::new() } else { [open, "\n", &items.concat(), "</ul>\n"].concat() }
}

/// A paragraph of text.
pub(super) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escape(text))
}

/// A head of a column: what stands in it, and a smaller line, as its unit.
pub(super) fn head(title: &str, unit: &str, class: &str) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!("<small>{}</small>", escape(unit)) };
    format!("<th scope=\"col\"{}>{}{unit}</th>", class_of(class), escape(title))
}

/// A cell of text.
pub(super) fn cell(text: &str, class: &str) -> String {
    format!("<td{}>{}</td>", class_of(class), escape(text))
}

fn class_of(class: &str) -> String {
    if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") }
}

/// A table that scrolls in itself where the page is narrow. Heads and cells are elements.
pub(super) fn table(caption: &str, heads: &[String], rows: &[Vec<String>]) -> String {
    let label = escape(caption);
    let rows: Vec<String> = rows.iter().map(|row| format!("<tr>{}</tr>\n", row.concat())).collect();
    format!(
        "<div class=\"scroll\" role=\"group\" aria-label=\"{label}\" tabindex=\"0\"><table><caption>{label}</caption>\
         <thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody></table></div>\n",
        heads.concat(),
        rows.concat()
    )
}

/// Terms and what they mean, as text.
pub(super) fn terms<'a>(terms: impl IntoIterator<Item = (&'a str, String)>) -> String {
    let terms = terms.into_iter().map(|(term, meaning)| {
        let meaning = if meaning.is_empty() { NONE.to_owned() } else { escape(&meaning) };
        format!("<dt>{}</dt><dd>{meaning}</dd>\n", escape(term))
    });
    format!("<dl>\n{}</dl>\n", terms.collect::<Vec<String>>().concat())
}

/// A figure: an element, and what is said below it, as an element too.
pub(super) fn figure(element: &str, caption: &str) -> String {
    format!("<figure>\n{element}<figcaption>{caption}</figcaption></figure>\n")
}

/// Figures side by side where there is room.
pub(super) fn grid(figures: &[String]) -> String {
    if figures.is_empty() {
        String::new()
    } else {
        format!("<div class=\"grid\">\n{}</div>\n", figures.concat())
    }
}

/// Wide figures, two beside each other where there is room.
pub(super) fn wide(figures: &[String]) -> String {
    format!("<div class=\"grid wide\">\n{}</div>\n", figures.concat())
}

/// A figure that stands alone.
pub(super) fn large(figure: &str) -> String {
    format!("<div class=\"large\">\n{figure}</div>\n")
}

/// What colours mean: pairs of a CSS colour and words.
pub(super) fn keys<'a>(keys: impl IntoIterator<Item = (String, &'a str)>) -> String {
    let keys = keys
        .into_iter()
        .map(|(colour, words)| format!("<span style=\"background:{colour}\"></span>{}", escape(words)));
    list("<ul class=\"keys\">", keys)
}

/// What lines mean: pairs of a line, as attributes of a path, and words.
pub(super) fn line_keys(keys: impl IntoIterator<Item = (String, String)>) -> String {
    let key = |(line, words): (String, String)| {
        let path = format!("<path d=\"M0 5H32\" fill=\"none\" {line}/>");
        format!("<svg viewBox=\"0 0 32 10\" aria-hidden=\"true\">{path}</svg>{}", escape(&words))
    };
    list("<ul class=\"keys\">", keys.into_iter().map(key))
}

/// A bar of colours between two words.
pub(super) fn bar(from: &str, colours: &[[u8; 3]], to: &str) -> String {
    let stops: Vec<String> = colours.iter().map(|colour| crate::colour::hex(*colour)).collect();
    format!(
        "<div class=\"bar\">{} <span style=\"background:linear-gradient(to right,{})\"></span> {}</div>\n",
        escape(from),
        stops.join(","),
        escape(to)
    )
}
