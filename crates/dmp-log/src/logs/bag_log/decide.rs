//! What the times of a topic's points mean.

use super::log::BagLog;
use crate::file::DamageList;
use crate::messages::{BagReader, Location};
use crate::points::{FieldExtremes, TimeChoice, TimeFields, choose_time, no_field, odd_times};
use crate::{Damage, LogError, LogOptions};

/// What a few scans of a log have in each of the fields that may hold times.
pub(super) type Seen = Vec<Vec<FieldExtremes>>;

/// Looks at a few scans of each log in the order of the bag: a chunk is unpacked once, however many topics it has.
pub(super) fn look_at(
    bag: &mut BagReader<'_>,
    logs: &[(&BagLog, Vec<usize>)],
    options: &LogOptions,
) -> Vec<Result<Seen, LogError>> {
    let mut found: Vec<(Vec<String>, Result<Seen, LogError>)> = Vec::with_capacity(logs.len());
    let mut scans: Vec<(Location, usize, usize)> = Vec::new();
    for (number, (log, frames)) in logs.iter().enumerate() {
        let asked = options.point_time_field.as_deref();
        let fields =
            log.topic.first_layout().map(|layout| TimeFields::of(layout, asked).all()).unwrap_or_default();
        if !fields.is_empty() {
            let entries = frames.iter().filter_map(|&frame| Some((log.topic.entries.get(frame)?, frame)));
            scans.extend(entries.map(|(entry, frame)| (entry.location, number, frame)));
        }
        let nothing = vec![Vec::new(); fields.len()];
        found.push((fields, Ok(nothing)));
    }
    scans.sort_by(|(a, ..), (b, ..)| a.compare(b));
    for (_, number, frame) in scans {
        let (fields, found) = &mut found[number];
        let Ok(seen_of_fields) = found else { continue };
        let looked = logs[number].0.with_cloud(bag, frame, |cloud| {
            for (field, seen) in fields.iter().zip(seen_of_fields) {
                let extremes = cloud.layout.time_field(field).and_then(|field| cloud.rows().extremes(field));
                if let Some((smallest, largest)) = extremes {
                    seen.push(FieldExtremes { frame, stamp_ns: cloud.stamp_ns, smallest, largest });
                }
            }
        });
        if let Err(problem) = looked {
            *found = Err(problem);
        }
    }
    found.into_iter().map(|(_, seen)| seen).collect()
}

impl BagLog {
    /// Finds the field with the times and what they mean from the frames that are `looked_at`, and gives up the
    /// scans that lack it. `period_ns` is that of the whole log.
    pub(super) fn decide_time(
        &mut self,
        options: &LogOptions,
        period_ns: Option<i64>,
        looked_at: Vec<usize>,
    ) -> Result<(), LogError> {
        let look = |log: &Self| {
            let seen = look_at(&mut log.bag.reader(), &[(log, looked_at)], options);
            seen.into_iter().next().unwrap_or_else(|| Ok(Seen::new()))
        };
        self.decide_time_from(options, period_ns, look)
    }

    /// The same where `look` gives what a few scans have in the fields that may hold times.
    pub(super) fn decide_time_from(
        &mut self,
        options: &LogOptions,
        period_ns: Option<i64>,
        look: impl FnOnce(&Self) -> Result<Seen, LogError>,
    ) -> Result<(), LogError> {
        let Some(layout) = self.topic.first_layout().filter(|_| self.summary.returns > 0) else {
            return Ok(());
        };
        let mut notes = std::mem::take(&mut self.summary.notes);
        let choice = choose_time(self.bag.path(), layout, options, period_ns, &mut notes, || look(self));
        self.summary.notes = notes;
        if let Some(choice) = choice? {
            if let Some(frame) = choice.odd_frame.filter(|&frame| frame < self.topic.entries.len()) {
                let odd = self.topic.entries.remove(frame);
                self.add_damage(vec![Damage::new(odd.in_words(), odd_times(&choice.field))]);
            }
            self.take_time(choice);
        }
        Ok(())
    }

    /// Takes the times of points to be what was found, and gives up the scans that lack them.
    pub(super) fn take_time(&mut self, choice: TimeChoice) {
        self.summary.take_time(&choice);
        let (layouts, mut damage) = (&self.topic.layouts, DamageList::default());
        self.topic.entries.retain(|entry| {
            let layout = layouts.get(entry.layout as usize);
            let kept =
                entry.returns == 0 || layout.is_some_and(|layout| layout.time_field(&choice.field).is_some());
            if !kept {
                damage.push(Damage::new(entry.in_words(), no_field(&choice.field)));
            }
            kept
        });
        self.add_damage(damage.into_vec());
        self.time = Some(choice);
    }

    pub(super) fn add_damage(&mut self, damage: Vec<Damage>) {
        let known = &mut self.summary.damage;
        for lost in damage {
            if !known.contains(&lost) {
                known.push(lost);
            }
        }
    }
}
