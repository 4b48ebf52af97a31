//! What the verdicts promise: the options.

use clap::Args;
use dmp::{Confidence, Config, Margin};

use crate::parse::length_m;

/// What the verdicts on all pairs of runs promise together.
#[derive(Debug, Args)]
pub(crate) struct PromiseArgs {
    /// How sure the verdicts are to be, all of them together: where runs are equal, no two of them are told apart in this
    /// share of commands, over all pairs, scales and looks
    #[arg(long, value_name = "P%", default_value = "99%", value_parser = confidence, help_heading = "Verdicts")]
    confidence: Confidence,
    /// Two runs are the same where they can be no further apart than this, as root mean squares at every scale: a share of
    /// the better one's own, as 10%, or a length, as 1cm
    #[arg(long, value_name = "P%|LENGTH", default_value = "10%", value_parser = margin, help_heading = "Verdicts")]
    same_within: Margin,
}

impl PromiseArgs {
    /// The settings with these.
    pub(super) fn of(&self, config: Config) -> Config {
        Config { confidence: self.confidence, same_within: self.same_within, ..config }
    }
}

/// `99%` or `0.99`.
fn confidence(text: &str) -> Result<Confidence, String> {
    let share = match text.strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().ok().map(|percent| percent / 100.0),
        None => text.parse().ok(),
    };
    let error = || format!("`{text}` is no confidence: try 99% (from 50% to below 100%)");
    share.and_then(Confidence::new).ok_or_else(error)
}

/// `10%` or `1cm`.
fn margin(text: &str) -> Result<Margin, String> {
    let error = || format!("`{text}` is no margin: try 10% or 1cm");
    let margin = match text.strip_suffix('%') {
        Some(percent) => {
            let percent = percent.trim_end().parse::<f64>().ok().filter(|percent| percent.is_finite());
            Margin::Share(percent.ok_or_else(error)? / 100.0)
        }
        None => Margin::Metres(length_m(text).map_err(|_| error())?),
    };
    let (Margin::Share(size) | Margin::Metres(size)) = margin;
    if size >= 0.0 { Ok(margin) } else { Err(error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_confidence_is_a_share_below_one() {
        assert_eq!(confidence("99%"), Ok(Confidence::P99));
        assert_eq!(confidence("0.99"), Ok(Confidence::P99));
        assert!(confidence("99.9 %").is_ok_and(|found| (found.level() - 0.999).abs() < 1e-12));
        for text in ["100%", "1", "0.4", "nan", "x", ""] {
            assert!(confidence(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_margin_is_a_share_or_a_length() {
        assert_eq!(margin("10%"), Ok(Margin::Share(0.1)));
        assert_eq!(margin("0%"), Ok(Margin::Share(0.0)));
        assert_eq!(margin("2cm"), Ok(Margin::Metres(0.02)));
        assert_eq!(margin("0.5"), Ok(Margin::Metres(0.5)));
        for text in ["", "x", "-1%", "nan%", "-3cm", "10 percent"] {
            assert!(margin(text).is_err_and(|e| e.ends_with("try 10% or 1cm")), "{text}");
        }
    }
}
