use crate::fixed::units_of;

/// As many truncations of `R_cv` as there are, and of `R_near`.
pub(crate) const CV: usize = 5;
pub(crate) const NEAR: usize = 3;
/// Where among those of `R_cv` the scale of the score stands in which a miss has its price.
pub(crate) const WIDEST: usize = 1;

/// The lengths by which residuals are judged: what is a gross error, what a small one.
///
/// They are in proportion to what sensors see: a LiDAR on a road sees walls 30 m away, a camera in a room those 3 m
/// away. `docs/metric.md` and `docs/paper.md` have the evidence for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scales {
    /// For a LiDAR: `R_cv` at 10, 2, 0.5 and 0.2 m, `R_near` at 5, 2 and 0.5 m.
    #[default]
    Drive,
    /// For depth cameras, a tenth of those: `R_cv` at 1, 0.2, 0.05 and 0.02 m, `R_near` at 0.5, 0.2 and 0.05 m.
    Room,
}

/// What a truncation sees of two maps: errors of the whole down to the sharpness of surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// The map as a whole: 10 and 5 m, in a room 1 and 0.5 m.
    Global,
    /// 2 m, in a room 0.2 m.
    Middle,
    /// 0.5 m, in a room 0.05 m.
    Local,
    /// 0.2 m, in a room 0.02 m.
    Fine,
}

/// Lengths, and their squares in units.
#[derive(Debug)]
pub(crate) struct Limits {
    cv_m: [f64; CV],
    near_m: [f64; NEAR],
    blocked_m: f64,
    /// τ² of `cv_m` in units of 2^-40 m².
    pub(crate) cv: [u64; CV],
    /// τ² of `near_m` in the same units.
    pub(crate) near: [u64; NEAR],
}

impl Limits {
    const fn new(cv_m: [f64; CV], near_m: [f64; NEAR], blocked_m: f64) -> Self {
        let (mut cv, mut near) = ([0; CV], [0; NEAR]);
        let mut k = 0;
        while k < CV {
            cv[k] = units_of(cv_m[k] * cv_m[k]);
            k += 1;
        }
        k = 0;
        while k < NEAR {
            near[k] = units_of(near_m[k] * near_m[k]);
            k += 1;
        }
        Self { cv_m, near_m, blocked_m, cv, near }
    }
}

static DRIVE: Limits = Limits::new([30.0, 10.0, 2.0, 0.5, 0.2], [5.0, 2.0, 0.5], 0.5);
static ROOM: Limits = Limits::new([3.0, 1.0, 0.2, 0.05, 0.02], [0.5, 0.2, 0.05], 0.05);

/// No truncated square is larger than this many bits, nor is the difference of two.
pub(crate) const TRUNCATED_BITS: u32 = 50;
const _: () = assert!(units_of(30.0 * 30.0) < 1 << TRUNCATED_BITS);

impl Scales {
    #[inline]
    pub(crate) fn limits(self) -> &'static Limits {
        match self {
            Self::Drive => &DRIVE,
            Self::Room => &ROOM,
        }
    }

    /// Truncations τ at which `R_cv` is summed, metres. The first serves the place guard alone, the second is
    /// [`Self::widest_m`].
    pub fn cv_m(self) -> &'static [f64; CV] {
        &self.limits().cv_m
    }

    /// Truncations τ at which `R_near` is summed, metres.
    pub fn near_m(self) -> &'static [f64; NEAR] {
        &self.limits().near_m
    }

    /// The largest scale of `R_cv` that is a score: the one in which a return without an independent crossing has its
    /// price, metres.
    pub fn widest_m(self) -> f64 {
        self.limits().cv_m[WIDEST]
    }

    /// How long what is a metre on a drive is on these scales, metres.
    pub fn metre_m(self) -> f64 {
        self.widest_m() / DRIVE.cv_m[WIDEST]
    }

    /// What a truncation sees of two maps.
    pub fn reach(self, scale_m: f64) -> Reach {
        match scale_m / self.metre_m() {
            m if m >= 5.0 => Reach::Global,
            m if m >= 1.0 => Reach::Middle,
            m if m >= 0.5 => Reach::Local,
            _ => Reach::Fine,
        }
    }

    /// Edge of the cubes of a map that count as one piece of surface, metres: errors are alike within, and have little in
    /// common beyond (`docs/accuracy.md`).
    #[inline]
    pub fn surface_m(self) -> f64 {
        4.0 * self.metre_m()
    }

    /// A return whose first surfel is crossed this much before the measured range is blocked, metres.
    #[inline]
    pub fn blocked_m(self) -> f64 {
        self.limits().blocked_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lengths_of_a_room_are_a_tenth() {
        assert_eq!(Scales::Drive.widest_m(), 10.0);
        assert_eq!(Scales::Room.widest_m(), 1.0);
        let tenth = |drive: &[f64], room: &[f64]| {
            drive.iter().zip(room).all(|(drive, room)| (drive / 10.0 - room).abs() < 1e-12)
        };
        assert!(tenth(Scales::Drive.cv_m(), Scales::Room.cv_m()));
        assert!(tenth(Scales::Drive.near_m(), Scales::Room.near_m()));
        for (scales, metre_m) in [(Scales::Drive, 1.0), (Scales::Room, 0.1)] {
            assert_eq!(scales.metre_m(), metre_m);
            let reaches = |scales_m: &[f64]| scales_m.iter().map(|&m| scales.reach(m)).collect::<Vec<_>>();
            let all = [Reach::Global, Reach::Global, Reach::Middle, Reach::Local, Reach::Fine];
            assert_eq!(reaches(scales.cv_m()), all);
            assert_eq!(reaches(scales.near_m()), all[1..4]);
        }
        assert_eq!(Scales::Drive.limits().near, [25 << 40, 4 << 40, 1 << 38]);
    }
}
