//! Converts names of runs to file names.

/// Most bytes of a stem: file systems allow 255, and derived files append to it.
const MOST_BYTES: usize = 200;

/// The name of a run as a file name; `names` are those of all runs. Problematic characters become `_`, long
/// names are cut, and equal results get their numbers.
pub fn file_stem_of(names: &[&str], name: &str) -> String {
    let harmless = |name: &str| -> String {
        let fits = name.char_indices().take_while(|(at, c)| at + c.len_utf8() <= MOST_BYTES);
        fits.map(|(_, c)| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
    };
    let stem = harmless(name);
    let alike: Vec<&&str> =
        names.iter().filter(|other| harmless(other).eq_ignore_ascii_case(&stem)).collect();
    match alike.iter().position(|&&other| other == name) {
        Some(number) if alike.len() > 1 => format!("{stem}-{}", number + 1),
        _ => stem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_has_a_file_of_its_own() {
        let names = ["a/x", "a_x", "A_X", "b ü"];
        assert_eq!(names.map(|name| file_stem_of(&names, name)), ["a_x-1", "a_x-2", "A_X-3", "b_ü"]);
        let long = ["1", "2"].map(|end| "ü".repeat(150) + end);
        let names = [long[0].as_str(), long[1].as_str()];
        assert_eq!(file_stem_of(&names, names[1]), "ü".repeat(100) + "-2");
    }
}
