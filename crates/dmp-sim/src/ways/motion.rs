//! How a vehicle moves and when: what drives through towns and through cities have in common.

use crate::error::{SimError, require};

/// When a drive starts if nothing else is asked for, nanoseconds.
pub(crate) const START_NS: i64 = 1_700_000_000_000_000_000;
/// A drive extends this far before the first and after the last requested instant, seconds.
pub(crate) const MARGIN_S: f64 = 2.0;
/// Height of a car's sensor above the ground, metres.
pub(crate) const HEIGHT_M: f64 = 1.9;
/// Sideways acceleration in curves and change of speed that a passenger would accept, m/s².
pub(crate) const SIDEWAYS_M_S2: f64 = 2.0;
pub(crate) const FORWARD_M_S2: f64 = 1.2;
/// Speeds on straight streets waver by at most this share, up or down.
pub(crate) const WAVER: f64 = 0.08;

/// Refuses a speed that is no car's.
pub(crate) fn require_speed(speed_m_s: f64) -> Result<(), SimError> {
    require((0.5..=40.0).contains(&speed_m_s), "the speed in m/s", "from 0.5 to 40", speed_m_s)
}

/// Time since the start of a drive, seconds, within the margins around it.
pub(crate) fn time_s(stamp_ns: i64, start_ns: i64, duration_s: f64) -> f64 {
    let time_s = stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
    time_s.clamp(-MARGIN_S, duration_s + MARGIN_S)
}

/// The stamps of the true poses of a drive, nanoseconds, `rate_hz` of them a second, from just before its start to just
/// after its end: at least three.
pub(crate) fn pose_stamps_ns(
    start_ns: i64,
    duration_s: f64,
    rate_hz: f64,
) -> Result<impl ExactSizeIterator<Item = i64>, SimError> {
    require((1.0..=1e4).contains(&rate_hz), "the rate of the poses in Hz", "from 1 to 10000", rate_hz)?;
    let count = (duration_s * rate_hz).ceil() as usize + 3;
    Ok((0..count).map(move |k| start_ns + libm::round((k as f64 - 1.0) * 1e9 / rate_hz) as i64))
}
