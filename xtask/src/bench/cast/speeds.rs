//! How fast casters are beside each other: in turns, each in a process of its own.

use dmp_cast::Path;

use super::arguments::CastArgs;
use super::files::Files;
use super::own::UP_TO;
use super::peers::{Peer, PeerKind};
use crate::bench::times::spread;

/// What Embree's single rays are compared with; the second bounds them by the measured range, in the widest packets.
const EMBREE_MODES: [&str; 2] = ["single", "wide16-bounded"];
/// All that Embree can do.
const ALL_EMBREE_MODES: [&str; 11] = [
    "single",
    "single-bounded",
    "single-filter",
    "wide4",
    "wide8",
    "wide16",
    "wide8-bounded",
    "wide16-bounded",
    "wide16-incoherent",
    "stream",
    "stream-bounded",
];

/// One mode of one caster and what was measured.
#[derive(Debug)]
pub(super) struct Row {
    caster: usize,
    mode: String,
    times_s: Vec<f64>,
}

impl Row {
    pub(super) fn new(caster: usize, mode: &str) -> Self {
        Self { caster, mode: mode.to_owned(), times_s: Vec::new() }
    }

    pub(super) fn median_s(&self) -> f64 {
        spread(self.times_s.clone())[0]
    }

    /// Millions a second of `count`: median, least, largest.
    pub(super) fn millions_per_s(&self, count: u64) -> [f64; 3] {
        let [median, least, largest] = spread(self.times_s.clone());
        [median, largest, least].map(|seconds| count as f64 / seconds / 1e6)
    }
}

/// Casters that have read their work.
pub(super) struct Casters {
    pub(super) peers: Vec<Peer>,
    pub(super) rows: Vec<Row>,
}

impl Casters {
    /// Starts all that can be had; says why others cannot.
    pub(super) fn start(arguments: &CastArgs, files: &Files) -> Self {
        let embrees = arguments.embree.iter().map(|options| PeerKind::embree(options));
        let open3d = PeerKind::Open3d { python: arguments.python.clone() };
        let mut casters = Self { peers: Vec::new(), rows: Vec::new() };
        for kind in embrees.chain([open3d, PeerKind::Own]) {
            let modes = match &kind {
                PeerKind::Embree { .. } if arguments.all_modes => {
                    ALL_EMBREE_MODES.map(str::to_owned).to_vec()
                }
                PeerKind::Embree { .. } => EMBREE_MODES.map(str::to_owned).to_vec(),
                PeerKind::Open3d { .. } => vec!["single".to_owned()],
                PeerKind::Own => own_modes(),
            };
            let name = kind.name();
            let modes = modes.into_iter().filter(|mode| format!("{name} {mode}").contains(&arguments.only));
            let modes: Vec<String> = modes.collect();
            if modes.is_empty() {
                continue;
            }
            match Peer::start(&kind, files, Some(arguments.core)) {
                Ok(peer) => {
                    println!("{}: {name}: {}", files.name, peer.ready);
                    casters.rows.extend(modes.iter().map(|mode| Row::new(casters.peers.len(), mode)));
                    casters.peers.push(peer);
                }
                Err(error) => println!("{}: without {name}: {error:#}", files.name),
            }
        }
        casters
    }

    /// Casts in turns, after one cast of each that does not count.
    pub(super) fn measure(&mut self, runs: u32) -> anyhow::Result<()> {
        measure(&mut self.peers, &mut self.rows, runs, 0.0)
    }

    pub(super) fn find(&self, caster: &str, mode: &str) -> Option<&Row> {
        self.rows.iter().find(|row| self.peers[row.caster].name() == caster && row.mode == mode)
    }

    /// The place of a caster among the peers.
    pub(super) fn place(&self, caster: &str) -> Option<usize> {
        self.peers.iter().position(|peer| peer.name() == caster)
    }

    /// Embree's single rays as it comes, and with the fastest of its options.
    pub(super) fn references(&self) -> Option<[&Row; 2]> {
        let single = |row: &&Row| row.mode == "single" && self.peers[row.caster].name().starts_with("embree");
        let fastest = self.rows.iter().filter(single).min_by(|a, b| a.median_s().total_cmp(&b.median_s()))?;
        Some([self.rows.iter().find(single)?, fastest])
    }

    pub(super) fn name(&self, row: &Row) -> &str {
        self.peers[row.caster].name()
    }

    /// The table of all rows but the building of trees.
    pub(super) fn print(&self) {
        let references = self.references();
        if let Some([first, fastest]) = references {
            println!("fast: {} single; plain: {} single", self.name(fastest), self.name(first));
        }
        println!(
            "{:<20}{:<32}{:>10}{:>18}{:>10}{:>10}",
            "caster", "mode", "M rays/s", "least – largest", "to fast", "to plain"
        );
        for row in self.rows.iter().filter(|row| row.mode != BUILD) {
            let [median, least, largest] = row.millions_per_s(self.peers[row.caster].rays());
            let ratio = |k: usize| match references {
                Some(references) => format!("{:.2}x", references[k].median_s() / row.median_s()),
                None => "-".to_owned(),
            };
            println!(
                "{:<20}{:<32}{median:>10.2}{:>18}{:>10}{:>10}",
                self.name(row),
                row.mode,
                format!("{least:.2} – {largest:.2}"),
                ratio(1),
                ratio(0)
            );
        }
    }

    /// What follows from the rows of the project's own caster among themselves.
    pub(super) fn print_ratios(&mut self, surfels: u64) -> anyhow::Result<()> {
        let best = Path::best().name();
        for (told, over, under) in [
            ("all three answers cost, bounded", "packets-three-bounded", "packets-bounded"),
            ("all three answers cost, unbounded", "packets-three", "packets"),
            ("tiles against one tree, single rays", "single-one-tree", "single"),
        ] {
            let [over, under] = [over, under].map(|mode| self.find("dmp", &format!("{best}-{mode}")));
            if let (Some(over), Some(under)) = (over, under) {
                println!("{told:<52}{:>10.2}x", over.median_s() / under.median_s());
            }
        }
        if let Some(row) = self.find("dmp", BUILD) {
            let [median, least, largest] = row.millions_per_s(surfels);
            let told = "trees of tiles built, M surfels/s";
            println!("{told:<52}{median:>10.2} {:>18}", format!("({least:.2} – {largest:.2})"));
            let caster = row.caster;
            let bytes = self.peers[caster].bytes()?;
            println!("{:<52}{:>10.1}", "trees of tiles, bytes per surfel", bytes as f64 / surfels as f64);
        }
        Ok(())
    }
}

/// Building of trees instead of casting.
const BUILD: &str = "build";

fn own_modes() -> Vec<String> {
    let best = Path::best().name();
    let paths = Path::all()
        .into_iter()
        .flat_map(|path| ["single", "packets-bounded"].map(|mode| format!("{}-{mode}", path.name())));
    let of_best = ["single-bounded", "packets", "packets-three-bounded", "packets-three", "single-one-tree"];
    let of_best = of_best.map(|mode| format!("{best}-{mode}"));
    paths.chain(of_best).chain([BUILD.to_owned()]).collect()
}

/// Casts in turns, after one cast of each that does not count; each as often as it takes to fill `least_s`.
pub(super) fn measure(peers: &mut [Peer], rows: &mut [Row], runs: u32, least_s: f64) -> anyhow::Result<()> {
    for row in rows.iter() {
        peers[row.caster].cast_s(&row.mode)?;
    }
    for _ in 0..runs {
        for row in rows.iter_mut() {
            let (mut sum_s, mut casts) = (0.0, 0.0);
            while casts == 0.0 || sum_s < least_s {
                sum_s += peers[row.caster].cast_s(&row.mode)?;
                casts += 1.0;
            }
            row.times_s.push(sum_s / casts);
        }
    }
    Ok(())
}

/// All rays twice on two threads against once on one, both free to run on any core.
pub(super) fn print_two_threads(files: &Files, runs: u32) -> anyhow::Result<()> {
    let best = Path::best().name();
    let mut peers = [Peer::start(&PeerKind::Own, files, None)?];
    let modes = ["single", "single-twice", "packets-bounded", "packets-bounded-twice"];
    let mut rows = modes.map(|mode| Row::new(0, &format!("{best}-{mode}")));
    measure(&mut peers, &mut rows, runs, 0.0)?;
    for pair in rows.chunks(2) {
        let told = format!("two threads against one, {}", pair[0].mode);
        println!("{told:<52}{:>10.2}x", 2.0 * pair[0].median_s() / pair[1].median_s());
    }
    Ok(())
}

/// How fast rays are cast with other limits to packets, on one core.
pub(super) fn print_limits(files: &Files, core: usize, runs: u32, rays: u64) -> anyhow::Result<()> {
    let best = Path::best().name();
    let mut peers = [Peer::start(&PeerKind::Own, files, Some(core))?];
    let limits = [0, 1, 2, 3, 4, 6, 8, 16, 64, 1000];
    let mut rows = limits.map(|squares| Row::new(0, &format!("{best}-{UP_TO}{squares}-bounded")));
    measure(&mut peers, &mut rows, runs, 0.0)?;
    println!("packets up to so many squares of a disc for each ray, bounded");
    for (squares, row) in limits.iter().zip(&rows) {
        let [median, least, largest] = row.millions_per_s(rays);
        println!("{squares:>52}{median:>10.2} {:>18}", format!("({least:.2} – {largest:.2})"));
    }
    Ok(())
}
