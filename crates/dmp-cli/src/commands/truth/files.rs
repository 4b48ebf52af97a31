//! The files of `dmp truth ape` and `dmp truth rpe`, and what is done to them before they are compared.

use std::path::PathBuf;

use dmp_log::TrajectoryFormat;
use dmp_truth::trajectory::{Alignment, ErrorUnit, Matching, PosePath, Preparation, Relation};

use crate::console::Usage;
use crate::files::is_missing;
use crate::options::{Asked, truth};

/// The files of a comparison, and the formats they must have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Files {
    pub(super) reference: PathBuf,
    pub(super) reference_format: Option<TrajectoryFormat>,
    /// One at least.
    pub(super) estimates: Vec<PathBuf>,
    pub(super) estimate_format: Option<TrajectoryFormat>,
}

impl Files {
    /// The first word is a format where it is one, or there is no such file.
    pub(super) fn of(asked: &Asked) -> Result<Self, Usage> {
        let mut files = asked.all(&truth::FILES);
        let first = files.first().cloned().unwrap_or_default();
        let format = match (first.to_string_lossy().parse(), files.len()) {
            (Ok(format), 3..) => Some(format),
            (Err(problem), 3..) if is_missing(&first) => return Err(Usage(problem)),
            _ => None,
        };
        if format.is_some() {
            files.remove(0);
        }
        let mut files = files.into_iter();
        let reference = files.next().ok_or_else(|| Usage("a reference and an estimate are needed".into()))?;
        // As in evo, but an estimate in EuRoC's own format is detected.
        let estimate_format = format.filter(|&format| format != TrajectoryFormat::Euroc);
        Ok(Self { reference, reference_format: format, estimates: files.collect(), estimate_format })
    }
}

fn alignment(asked: &Asked) -> Alignment {
    Alignment {
        pose: asked.has(&truth::ALIGN),
        scale: asked.has(&truth::CORRECT_SCALE),
        origin: asked.has(&truth::ALIGN_ORIGIN),
    }
}

/// What is done to both before they are compared.
pub(super) fn preparation(asked: &Asked, reference: &PosePath) -> Result<Preparation, Usage> {
    let times = [&truth::T_MAX_DIFF, &truth::T_OFFSET, &truth::T_START, &truth::T_END];
    let [max_diff_s, offset_s, start_s, end_s] = times.map(|option| asked.get(option));
    let is_timed = [max_diff_s, offset_s, start_s, end_s].iter().any(Option::is_some)
        || asked.get(&truth::TIME_UNIT).is_some();
    if reference.stamps_s().is_none() && is_timed {
        return Err(Usage("trajectories without stamps have no options of time".into()));
    }
    // Zero alone asks for nothing, as in evo.
    let cut = [start_s, end_s].iter().any(|time| time.is_some_and(|time| time != 0.0));
    Ok(Preparation {
        start_s: start_s.filter(|_| cut),
        end_s: end_s.filter(|_| cut),
        matching: Matching { max_diff_s: max_diff_s.unwrap_or(0.01), offset_s: offset_s.unwrap_or(0.0) },
        alignment: alignment(asked),
    })
}

/// The heading, word by word as evo has it.
pub(super) fn title(asked: &Asked, metric: &str, relation: Relation, unit: ErrorUnit, tail: &str) -> String {
    let Alignment { pose, scale, origin } = alignment(asked);
    let how = match (pose, scale, origin) {
        (true, false, _) => "\n(with SE(3) Umeyama alignment)",
        (true, true, _) => "\n(with Sim(3) Umeyama alignment)",
        (false, true, _) => "\n(scale corrected)",
        (false, false, false) => "\n(not aligned)",
        (false, false, true) => "",
    };
    let at_origin = if origin { "\n(with origin alignment)" } else { "" };
    format!("{} w.r.t. {} ({}){tail}{how}{at_origin}", metric.to_uppercase(), relation.name(), unit.name())
}
