//! Where the times of a folder's points are, and what they mean.

use super::log::ScanFolder;
use super::times;
use crate::file::DamageList;
use crate::logs::scan_folder::scan_file::ScanFormat;
use crate::points::{
    FieldExtremes, Origin, TimeChoice, TimeFields, TimeRule, TimeUnit, choose_time, frames_to_look_at,
    no_field, odd_times,
};
use crate::{Damage, LogError, LogOptions, LogSetting, shown_path};
use std::path::{Path, PathBuf};

impl ScanFolder {
    /// Finds the times of the points and what they mean, and gives up the scans that lack them.
    pub(super) fn decide_time(&mut self, options: &LogOptions) -> Result<(), LogError> {
        let folder = self.summary.path.clone();
        let stamped = self.entries.iter().any(|entry| entry.stamp_ns.is_some());
        if let Some(times) = times::folder_beside(&folder)? {
            let notes = (self.summary.period_ns, &mut self.summary.notes);
            let Some(choice) = times::choose(&times, &self.entries, options, &self.count, notes)? else {
                return Ok(());
            };
            if choice.rule.origin == Origin::Clock && !stamped {
                return Err(needs_stamps(&folder, options));
            }
            self.give_up(&choice);
            self.take_time(choice);
            self.times = Some(times);
            return Ok(());
        }
        let Some(layout) = self.first_layout().filter(|_| self.summary.returns > 0) else { return Ok(()) };
        let asked = options.point_time_field.as_deref();
        let fields = TimeFields::of(layout, asked);
        if asked.is_none() && TimeRule::given(options.point_time).is_some() && fields.named.is_empty() {
            let problem = format!(
                "was given, but the points have no field for a time among [{}], and there is no folder times/ beside the scans",
                layout.names().join(", ")
            );
            return Err(LogError::setting(&folder, LogSetting::PointTime, options.point_time, problem));
        }
        let mut notes = self.summary.notes.clone();
        let look = || self.extremes(&fields.all());
        let choice = choose_time(&folder, layout, options, self.summary.period_ns, &mut notes, look);
        self.summary.notes = notes;
        let Some(choice) = choice? else { return Ok(()) };
        if choice.rule.origin == Origin::Clock && !stamped {
            return Err(needs_stamps(&folder, options));
        }
        if self.format == ScanFormat::Las && choice.rule.unit != TimeUnit::Seconds && is_open(options) {
            return Err(las_has_seconds(folder, &choice));
        }
        self.give_up(&choice);
        let (layouts, mut damage) = (&self.layouts, DamageList::default());
        self.entries.retain(|entry| {
            let layout = layouts.get(entry.layout);
            let kept =
                entry.points == 0 || layout.is_some_and(|layout| layout.time_field(&choice.field).is_some());
            if !kept {
                damage.push(Damage::new(shown_path(&entry.file.path), no_field(&choice.field)));
            }
            kept
        });
        self.summary.damage.append(&mut damage.into_vec());
        self.take_time(choice);
        Ok(())
    }

    fn take_time(&mut self, choice: TimeChoice) {
        self.summary.take_time(&choice);
        self.time = Some(choice);
    }

    /// Leaves out the scan whose times are unlike those of the others.
    fn give_up(&mut self, choice: &TimeChoice) {
        if let Some(frame) = choice.odd_frame.filter(|&frame| frame < self.entries.len()) {
            let odd = self.entries.remove(frame);
            self.summary.damage.push(Damage::new(shown_path(&odd.file.path), odd_times(&choice.field)));
        }
    }

    /// What a few scans have in the fields that may hold times.
    fn extremes(&self, fields: &[String]) -> Result<Vec<Vec<FieldExtremes>>, LogError> {
        let mut seen_of_fields: Vec<Vec<FieldExtremes>> = vec![Vec::new(); fields.len()];
        let mut data = Vec::new();
        for frame in frames_to_look_at(self.entries.iter().map(|entry| entry.points)) {
            let Some(entry) = self.entries.get(frame) else { continue };
            let rows = self.rows_of(entry, &mut data)?;
            for (field, seen) in fields.iter().zip(&mut seen_of_fields) {
                let extremes = rows.layout.time_field(field).and_then(|field| rows.extremes(field));
                if let Some((smallest, largest)) = extremes {
                    let stamp_ns = entry.stamp_ns.unwrap_or(0);
                    seen.push(FieldExtremes { frame, stamp_ns, smallest, largest });
                }
            }
        }
        Ok(seen_of_fields)
    }
}

/// Whether the meaning of times is left to be found.
fn is_open(options: &LogOptions) -> bool {
    TimeRule::given(options.point_time).is_none()
}

/// Stations of a surveyor's scanner take minutes, which look like milliseconds of a turning one.
fn las_has_seconds(path: PathBuf, choice: &TimeChoice) -> LogError {
    let problem = format!("LAS has seconds there, but only as {} do they fit the scans", choice.rule.words());
    LogError::PointTime { path, field: format!("in field `{}`", choice.field), problem }
}

fn needs_stamps(folder: &Path, options: &LogOptions) -> LogError {
    let problem = "needs stamps of the scans, and there is neither a times.txt nor a stamp in the file names";
    LogError::setting(folder, LogSetting::PointTime, options.point_time, problem)
}
