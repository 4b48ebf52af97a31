//! Logs in one file, or in a bag: MCAP and rosbag2.

use crate::attack::mcap::{CHUNK, Chunk, DATA_END, FOOTER, Record, file_of, of_file};
use crate::trials::{File, Form, Kind, Seed, Shop, seed};

/// A log with one trajectory beside it.
const CALLS: [&str; 8] = [
    "info log.mcap",
    "info log.mcap -t t.tum --json",
    "score log.mcap -t t.tum --json --quiet",
    "score log.mcap -t t.tum",
    "map build log.mcap -t t.tum -o out.dmpmap => map verify out.dmpmap",
    "convert log log.mcap -o out.mcap => info out.mcap",
    "calibrate log.mcap -t t.tum --json",
    "drift log.mcap -t t.tum --json --trust",
];

pub(super) fn kinds(shop: &Shop<'_>) -> anyhow::Result<Vec<Kind>> {
    Ok(vec![
        Kind { name: "MCAP", seeds: mcap(shop)? },
        Kind { name: "MCAP, quick", seeds: vec![quick(shop)?] },
        Kind { name: "MCAP of others", seeds: mcap_of_others(shop)? },
        Kind { name: "rosbag2", seeds: rosbag2(shop)? },
    ])
}

fn mcap(shop: &Shop<'_>) -> anyhow::Result<Vec<Seed>> {
    let truth = shop.made("t.tum", None)?;
    let mut seeds = Vec::new();
    for (n, packing) in ["zstd", "lz4", "none"].into_iter().enumerate() {
        let path = format!("{packing}.mcap");
        shop.make(&format!("convert log t.mcap -o {path} --compression {packing}"))?;
        let whole = shop.made(&path, Form::Mcap)?.bytes;
        // As it is written, and as a recorder leaves it that was killed: in small chunks without a summary.
        for bytes in [in_chunks(&whole, 3 + n)?, whole] {
            let log = File { path: "log.mcap".into(), bytes, form: Some(Form::Mcap) };
            seeds.push(Seed { is_guarded: true, ..seed(vec![log, truth.clone()], &CALLS) });
        }
    }
    Ok(seeds)
}

/// The log in `n` chunks, without indexes and summary.
fn in_chunks(file: &[u8], n: usize) -> anyhow::Result<Vec<u8>> {
    let mut records = Vec::new();
    for record in of_file(file).unwrap_or_default() {
        match (record.op, Chunk::unpacked(&record)) {
            (1, _) => records.push(record),
            (CHUNK, Some(chunk)) => {
                for part in chunk.split(n) {
                    records.push(part.packed()?);
                }
            }
            _ => {}
        }
    }
    records.push(Record { op: DATA_END, body: vec![0; 4] });
    records.push(Record { op: FOOTER, body: vec![0; 20] });
    Ok(file_of(&records))
}

fn quick(shop: &Shop<'_>) -> anyhow::Result<Seed> {
    let files = vec![shop.made("q.mcap", Form::Mcap)?, shop.made("q.tum", None)?];
    let calls = [
        "score q.mcap -t q.tum --quick=100% --json --quiet",
        "score q.mcap -t q.tum --sample 8 --json --quiet --residuals out.ply -o out.ply",
        "truth study q.mcap -t q.tum --reference q.tum --json",
    ];
    let mut seed = Seed { is_guarded: true, ..seed(files, &calls) };
    // `-o` only told what is written.
    let sample = &mut seed.calls[1];
    sample.words.truncate(sample.words.len() - 2);
    Ok(seed)
}

fn mcap_of_others(shop: &Shop<'_>) -> anyhow::Result<Vec<Seed>> {
    let mut seeds = Vec::new();
    for name in shop.names_of_others("mcap", ".mcap")? {
        let log = shop.of_others(&format!("mcap/{name}"), "log.mcap", Form::Mcap)?;
        let mut calls = vec!["info log.mcap --json", "info log.mcap"];
        if !name.starts_with("two_clouds") {
            calls.push("convert log log.mcap -o out.mcap => info out.mcap");
        }
        if name.starts_with("poses") {
            calls.extend([
                "score log.mcap -t topic:/odom --json --quiet",
                "info log.mcap -t topic:/tf --json",
                "info log.mcap -t topic:/slam/path --json",
                "score log.mcap -t topic:/slam/pose --extrinsic frame:base_link --json --quiet",
            ]);
        }
        seeds.push(seed(vec![log], &calls));
    }
    Ok(seeds)
}

fn rosbag2(shop: &Shop<'_>) -> anyhow::Result<Vec<Seed>> {
    let mut seeds = Vec::new();
    for (folder, form) in [("sqlite3", Form::Sqlite), ("sqlite3_split", Form::Sqlite), ("mcap", Form::Mcap)] {
        let mut files = Vec::new();
        for name in shop.names_of_others(&format!("rosbag2/{folder}"), "")? {
            let form = if name.ends_with("yaml") { Form::Text } else { form };
            files.push(shop.of_others(&format!("rosbag2/{folder}/{name}"), &format!("bag/{name}"), form)?);
        }
        let calls = [
            "info bag --json",
            "score bag -t topic:/pose --json --quiet",
            "convert log bag -o out.mcap => info out.mcap",
        ];
        seeds.push(seed(files, &calls));
    }
    let base = shop.of_others("rosbag2/sqlite3/sqlite3.db3", "log.db3", Form::Sqlite)?;
    let calls = [
        "info log.db3 --json",
        "score log.db3 -t topic:/pose --json --quiet",
        "convert log log.db3 -o out --to pcd => info out",
    ];
    seeds.push(seed(vec![base], &calls));
    Ok(seeds)
}
