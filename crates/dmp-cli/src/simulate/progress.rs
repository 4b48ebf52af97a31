//! The progress of a simulation, on standard error or to the program that runs it.

use std::cell::Cell;
use std::time::Instant;

use dmp::EvaluateError;
use dmp_sensor::Scan;
use indicatif::{HumanBytes, ProgressBar, ProgressStyle};

use crate::common::Common;
use crate::host::Hosted;
use crate::progress::target;

/// Bytes of a return in a packed log, about: for an estimate of the size of the log.
const PACKED_BYTES: f64 = 7.5;

/// What is shown of images, and of scans.
const IMAGES: &str = "{bar:30} {pos}/{len} images, {msg}, {eta} left";
const SCANS: &str = "{bar:30} {pos}/{len} scans, {msg}, {eta} left";

/// The progress of a simulation: a bar on standard error where that is a terminal, gone when dropped; or passed to the program
/// that runs the command.
#[derive(Debug)]
pub(super) struct Progress {
    bar: ProgressBar,
    host: Hosted,
    scans: usize,
    /// Returns in scans, or bytes of images.
    written: Cell<u64>,
    since: Instant,
}

impl Progress {
    pub(super) fn new(common: &Common, scans: usize) -> Self {
        Self::with(common, scans, ("scans", SCANS))
    }

    pub(super) fn of_images(common: &Common, images: usize) -> Self {
        Self::with(common, images, ("images", IMAGES))
    }

    fn with(common: &Common, scans: usize, (unit, template): (&'static str, &str)) -> Self {
        let host = common.host.clone();
        if let Some(program) = host.program() {
            program.begin("simulating", unit, Some(scans as u64));
        }
        let bar = ProgressBar::with_draw_target(Some(scans as u64), target(common));
        // The templates are fixed: a wrong one would show in any run on a terminal.
        let bar = match ProgressStyle::with_template(template) {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        };
        Self { bar, host, scans, written: Cell::new(0), since: Instant::now() }
    }

    fn step(&self) {
        self.bar.inc(1);
        if let Some(program) = self.host.program() {
            program.advance(1);
        }
    }

    /// Fails where somebody asked to stop.
    pub(super) fn go_on(&self) -> Result<(), EvaluateError> {
        self.host.go_on()
    }

    /// A scan is in the log.
    pub(super) fn written(&self, scan: &Scan) {
        let returns = self.written.get() + scan.len() as u64;
        self.written.set(returns);
        self.step();
        if self.bar.is_hidden() || self.bar.position() % 16 != 1 {
            return;
        }
        let per_s = returns as f64 / self.since.elapsed().as_secs_f64().max(1e-3);
        let whole = returns as f64 * self.scans as f64 / self.bar.position() as f64 * PACKED_BYTES;
        let size = HumanBytes(whole as u64);
        self.bar.set_message(format!("{:.1} M returns/s, about {size} in the end", per_s * 1e-6));
    }

    /// An image of so many bytes is in the log.
    pub(super) fn image_written(&self, bytes: usize) {
        let written = self.written.get() + bytes as u64;
        self.written.set(written);
        self.step();
        if self.bar.is_hidden() || self.bar.position() % 16 != 1 {
            return;
        }
        let per_s = self.bar.position() as f64 / self.since.elapsed().as_secs_f64().max(1e-3);
        let whole = written as f64 * self.scans as f64 / self.bar.position() as f64;
        self.bar.set_message(format!("{per_s:.1} images/s, about {} in the end", HumanBytes(whole as u64)));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
