//! Speeds of casters side by side: in turns, each in its own process.

use dmp_cast::Path;

use super::files::Files;
use super::peers::{Peer, PeerKind};
use crate::bench::times::spread;

/// Embree's single rays are the reference; the second mode has the widest packets, bounded by the measured range.
const EMBREE_MODES: [&str; 2] = ["single", "wide16-bounded"];

/// One mode of one caster with its times.
#[derive(Debug)]
struct Row {
    caster: usize,
    mode: String,
    times_s: Vec<f64>,
}

impl Row {
    fn median_s(&self) -> f64 {
        spread(self.times_s.clone())[0]
    }
}

/// Casters that have read their work.
#[derive(Debug)]
pub(super) struct Casters {
    pub(super) peers: Vec<Peer>,
    rows: Vec<Row>,
    rays: u64,
}

impl Casters {
    /// Starts all that the machine has; prints why others are missing.
    pub(super) fn start(embree: &[String], python: &std::path::Path, core: usize, files: &Files) -> Self {
        let embrees = embree.iter().map(|options| PeerKind::Embree(options.clone()));
        let open3d = PeerKind::Open3d(python.to_owned());
        let rays = std::fs::metadata(&files.rays).map_or(0, |file| file.len() / 28);
        let mut casters = Self { peers: Vec::new(), rows: Vec::new(), rays };
        for kind in embrees.chain([open3d, PeerKind::Own]) {
            let modes = match &kind {
                PeerKind::Embree(_) => EMBREE_MODES.map(str::to_owned).to_vec(),
                PeerKind::Open3d(_) => vec!["single".to_owned()],
                PeerKind::Own => own_modes(),
            };
            match Peer::start(&kind, files, core) {
                Ok(peer) => {
                    println!("{}: {}: {}", files.name, peer.name, peer.ready);
                    let caster = casters.peers.len();
                    let row = |mode| Row { caster, mode, times_s: Vec::new() };
                    casters.rows.extend(modes.into_iter().map(row));
                    casters.peers.push(peer);
                }
                Err(error) => println!("{}: without {}: {error:#}", files.name, kind.name()),
            }
        }
        casters
    }

    /// Casts in turns, after one cast of each that does not count.
    pub(super) fn measure(&mut self, runs: u32) -> anyhow::Result<()> {
        for turn in 0..=runs {
            for row in &mut self.rows {
                let seconds = self.peers[row.caster].cast_s(&row.mode)?;
                row.times_s.extend((turn > 0).then_some(seconds));
            }
        }
        Ok(())
    }

    /// The table: speeds, and their ratios to Embree's single rays with its fastest instructions and as it comes.
    pub(super) fn print(&self) {
        let name = |row: &Row| self.peers[row.caster].name.as_str();
        let single = |row: &&Row| row.mode == "single" && name(row).starts_with("embree");
        let plain = self.rows.iter().find(single);
        let fast = self.rows.iter().filter(single).min_by(|a, b| a.median_s().total_cmp(&b.median_s()));
        if let (Some(fast), Some(plain)) = (fast, plain) {
            println!("fast: {} single; plain: {} single", name(fast), name(plain));
        }
        println!(
            "{:<20}{:<32}{:>10}{:>18}{:>10}{:>10}",
            "caster", "mode", "M rays/s", "least – largest", "to fast", "to plain"
        );
        for row in &self.rows {
            let [median, largest, least] =
                spread(row.times_s.clone()).map(|seconds| self.rays as f64 / seconds / 1e6);
            let ratio = |reference: Option<&Row>| match reference {
                Some(reference) => format!("{:.2}x", reference.median_s() / row.median_s()),
                None => "-".to_owned(),
            };
            println!(
                "{:<20}{:<32}{median:>10.2}{:>18}{:>10}{:>10}",
                name(row),
                row.mode,
                format!("{least:.2} – {largest:.2}"),
                ratio(fast),
                ratio(plain)
            );
        }
    }
}

/// Single rays and packets with all instructions; with the best, also the packets of `dmp score`, with three answers.
fn own_modes() -> Vec<String> {
    let modes = |path: Path| ["single", "packets-bounded"].map(|mode| format!("{}-{mode}", path.name()));
    let of_score = format!("{}-packets-three-bounded", Path::best().name());
    Path::all().into_iter().flat_map(modes).chain([of_score]).collect()
}
