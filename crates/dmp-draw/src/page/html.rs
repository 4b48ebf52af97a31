//! Pieces of a page.

use crate::plot::escape;
use crate::text::NONE;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_a_page() {
        let nasty = "<b>&\"'";
        for element in [
            section("x", nasty, "y"),
            paragraph(nasty),
            head(nasty, nasty, "name"),
            cell(nasty, ""),
            table(nasty, &[], &[]),
            terms([(nasty, nasty.to_owned())]),
            keys([("#000".to_owned(), nasty)]),
            line_keys([("stroke=\"#000\"".to_owned(), nasty.to_owned())]),
            bar(nasty, &[[1, 2, 3]], nasty),
        ] {
            assert!(!element.contains("<b>") && element.contains("&lt;b&gt;&amp;&quot;&#39;"), "{element}");
        }
        assert_eq!(section("x", "y", ""), "");
    }
}
