//! What is lost, in a list that stays short whatever a file is like.

use super::decimal::shorten;
use super::printable;
use dmp_lengths::thousands;
use std::collections::BTreeMap;

/// Most places that are named.
const MOST_NAMED: usize = 100;
/// Most kinds by which the others are counted.
const MOST_KINDS: usize = 16;

/// Something that is lost.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Damage {
    /// Where, as `byte 4711` or `scans/000007.bin, byte 160`.
    pub place: String,
    /// What is wrong there and what is lost by it.
    pub what: String,
    /// How many places it stands for: one, or those beyond the first hundred that are counted by kind.
    pub places: u64,
}

impl Damage {
    pub(crate) fn new(place: impl Into<String>, what: impl Into<String>) -> Self {
        // Names of files and topics stand in both.
        let [place, what] = [place.into(), what.into()].map(|text| printable(&text).into_owned());
        Self { place, what, places: 1 }
    }
}

/// The first places with damage, and how many of each kind come after them: a file may have millions.
#[derive(Debug, Clone, Default)]
pub(crate) struct DamageList {
    named: Vec<Damage>,
    more: BTreeMap<String, u64>,
}

impl DamageList {
    pub(crate) fn is_empty(&self) -> bool {
        self.named.is_empty()
    }

    pub(crate) fn push(&mut self, damage: Damage) {
        if self.named.len() < MOST_NAMED {
            self.named.push(damage);
        } else {
            self.count(kind_of(&damage.what), 1);
        }
    }

    /// Takes in what another list has, its places with the name of their file.
    pub(crate) fn append(&mut self, other: Self, in_file: impl Fn(Damage) -> Damage) {
        other.named.into_iter().for_each(|damage| self.push(in_file(damage)));
        other.more.into_iter().for_each(|(kind, count)| self.count(kind, count));
    }

    fn count(&mut self, kind: String, count: u64) {
        let is_new = !self.more.contains_key(&kind) && self.more.len() >= MOST_KINDS;
        let kind = if is_new { "other damage".to_owned() } else { kind };
        *self.more.entry(kind).or_default() += count;
    }

    /// The named places, and an entry for each kind of the others.
    pub(crate) fn into_vec(self) -> Vec<Damage> {
        let more = self.more.into_iter().map(|(what, count)| {
            let place = if count == 1 {
                "1 more place".to_owned()
            } else {
                format!("{} more places", thousands(count))
            };
            Damage { place, what, places: count }
        });
        self.named.into_iter().chain(more).collect()
    }
}

/// The first loss, in words behind a message that nothing can be read; nothing where nothing is lost.
pub(crate) fn first_in_words(damage: &[Damage]) -> String {
    damage.first().map(|first| format!("; {}: {}", first.place, first.what)).unwrap_or_default()
}

/// What a message begins with in front of its values.
fn kind_of(what: &str) -> String {
    let values = |c: char| c.is_ascii_digit() || c == '`';
    match what.split(values).next().map(str::trim_end) {
        Some(kind) if !kind.is_empty() && kind.len() < what.len() => format!("{} …", shorten(kind)),
        _ => shorten(what),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn damage(k: usize, what: &str) -> Damage {
        Damage::new(format!("byte {k}"), what)
    }

    #[test]
    fn the_first_are_named_and_the_others_counted_by_kind() {
        let mut list = DamageList::default();
        for k in 0..1000 {
            list.push(damage(k, &format!("a chunk of {k} bytes is damaged")));
        }
        list.push(damage(1000, "the tail is lost"));
        let mut all = DamageList::default();
        all.append(list, |lost| Damage { place: format!("a.mcap, {}", lost.place), ..lost });
        all.push(damage(1001, "the tail is lost"));
        let all = all.into_vec();
        assert_eq!(all.len(), MOST_NAMED + 2);
        assert_eq!(all[99].place, "a.mcap, byte 99");
        let entry = |place: &str, what: &str, places| Damage { places, ..Damage::new(place, what) };
        assert_eq!(
            all[100..],
            [entry("900 more places", "a chunk of …", 900), entry("2 more places", "the tail is lost", 2)]
        );
    }

    #[test]
    fn nothing_makes_the_list_long() {
        let mut list = DamageList::default();
        for k in 0..10_000_usize {
            let word: String = k.to_string().bytes().map(|c| char::from(c + b'A' - b'0')).collect();
            list.push(damage(k, &format!("{word} is lost")));
        }
        let all = list.into_vec();
        assert_eq!(all.len(), MOST_NAMED + MOST_KINDS + 1);
        assert!(all.iter().any(|lost| lost.what == "other damage" && lost.place == "9,884 more places"));
    }
}
