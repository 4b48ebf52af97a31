//! What the times of a topic's points mean.

use super::log::{BagLog, BagScanReader};
use crate::damage::DamageList;
use crate::points::{FieldExtremes, TimeChoice, choose_time};
use crate::{Damage, LogError, LogOptions};

impl BagLog {
    /// Finds the field with the times and what they mean from the frames that are `looked_at`, and gives up the
    /// scans that lack it. `period_ns` is that of the whole log.
    pub(super) fn decide_time(
        &mut self,
        options: &LogOptions,
        period_ns: Option<i64>,
        looked_at: &[usize],
    ) -> Result<(), LogError> {
        let Some(layout) = self.topic.first_layout().filter(|_| self.summary.returns > 0) else {
            return Ok(());
        };
        let mut notes = std::mem::take(&mut self.summary.notes);
        let look = |fields: &[String]| self.extremes(fields, looked_at);
        let choice = choose_time(self.bag.path(), layout, options, period_ns, &mut notes, look);
        self.summary.notes = notes;
        if let Some(choice) = choice? {
            self.take_time(choice);
        }
        Ok(())
    }

    /// Takes the times of points to be what was found, and gives up the scans that lack them.
    pub(super) fn take_time(&mut self, choice: TimeChoice) {
        self.summary.point_times = Some(choice.words.clone());
        self.summary.middle_ns = choice.middle_ns;
        self.summary.sweep_ns = choice.sweep_ns;
        let (layouts, mut damage) = (&self.topic.layouts, DamageList::default());
        self.topic.entries.retain(|entry| {
            let layout = layouts.get(entry.layout as usize);
            let kept =
                entry.returns == 0 || layout.is_some_and(|layout| layout.field(&choice.field).is_some());
            if !kept {
                let place = format!("message {} ({})", entry.message, entry.location.in_words());
                let what = format!(
                    "no field `{}`, which the log's first scan has; the scan is skipped",
                    choice.field
                );
                damage.push(Damage::new(place, what));
            }
            kept
        });
        self.add_damage(damage.into_vec());
        self.time = Some(choice);
    }

    /// Adds what is not known already.
    pub(super) fn add_damage(&mut self, damage: Vec<Damage>) {
        let known = &mut self.summary.damage;
        for lost in damage {
            if !known.contains(&lost) {
                known.push(lost);
            }
        }
    }

    /// What a few scans have in the fields that may hold times.
    fn extremes(&self, fields: &[String], looked_at: &[usize]) -> Result<Vec<Vec<FieldExtremes>>, LogError> {
        let mut seen_of_fields: Vec<Vec<FieldExtremes>> = vec![Vec::new(); fields.len()];
        let mut reader = BagScanReader { log: self, bag: self.bag.reader() };
        for &frame in looked_at {
            reader.with_cloud(frame, |cloud| {
                for (field, seen) in fields.iter().zip(&mut seen_of_fields) {
                    let extremes = cloud.layout.field(field).and_then(|field| cloud.rows().extremes(field));
                    if let Some((smallest, largest)) = extremes {
                        seen.push(FieldExtremes { stamp_ns: cloud.stamp_ns, smallest, largest });
                    }
                }
            })?;
        }
        Ok(seen_of_fields)
    }
}
