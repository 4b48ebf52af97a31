use std::sync::atomic::{AtomicBool, Ordering};

use crate::Exit;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Prepares this process: Ctrl-C and requests to end are noted instead of ending it at once, so that
/// scratch files are removed; a second one ends it.
pub(crate) fn prepare() {
    // Without a handler an interrupt ends the process as it always did; that is no reason not to work.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(Exit::Interrupted as i32);
        }
    });
    let standard = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        // The LAZ decoder asserts on damaged bits. The reader catches that and reports the file; what the
        // assertion says is noise.
        let of_decoder = panic.location().is_some_and(|place| place.file().contains("/laz-"));
        if !of_decoder {
            standard(panic);
        }
    }));
}

/// Whether the process was asked to stop.
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
