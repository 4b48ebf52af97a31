//! Trajectories, calibrations, pose graphs and saved results.

use crate::trials::{File, Form, Kind, Seed, Shop, seed};

pub(super) fn kinds(shop: &Shop<'_>) -> anyhow::Result<Vec<Kind>> {
    Ok(vec![
        Kind { name: "TUM", seeds: vec![trajectory(shop, "tum")?] },
        Kind { name: "KITTI poses", seeds: vec![trajectory(shop, "kitti")?] },
        Kind { name: "EuRoC", seeds: vec![trajectory(shop, "euroc")?] },
        Kind { name: "Redwood", seeds: vec![trajectory(shop, "redwood")?] },
        Kind { name: "npy", seeds: of_others(shop, "npy")? },
        Kind { name: "g2o poses", seeds: of_others(shop, "g2o")? },
        Kind { name: "calibration", seeds: vec![calibration(shop)?] },
        Kind { name: "pose graph", seeds: vec![graph(shop)?] },
        Kind { name: "saved result", seeds: vec![result(shop)?] },
    ])
}

/// The truth in a format; KITTI and Redwood have their stamps beside them.
fn trajectory(shop: &Shop<'_>, to: &str) -> anyhow::Result<Seed> {
    let folder = format!("as-{to}");
    // Outputs do not make their folders.
    shop.make(&format!("man -o {folder}"))?;
    // A file a scan, so that rows without stamps belong to scans.
    shop.make(&format!("convert trajectory scans.tum -o {folder}/run.txt --to {to}"))?;
    let mut files = vec![shop.made("t.mcap", None)?, shop.made("t.tum", None)?];
    files.push(shop.made(&format!("{folder}/run.txt"), Form::Text)?);
    if ["kitti", "redwood"].contains(&to) {
        files.push(shop.made(&format!("{folder}/times.txt"), Form::Text)?);
    }
    let calls = [
        format!("info t.mcap -t {folder}/run.txt --json"),
        format!("score t.mcap -t {folder}/run.txt --json --quiet"),
        format!("score t.mcap -t {folder}/run.txt -t t.tum --between run=t.tum --json --quiet"),
        format!("map build t.mcap -t {folder}/run.txt -o out.dmpmap => map verify out.dmpmap"),
        format!("convert trajectory {folder}/run.txt -o out.tum --to tum"),
        format!("truth ape t.tum {folder}/run.txt --json"),
        format!("truth rpe t.tum {folder}/run.txt --json"),
        format!("simulate errors {folder}/run.txt --drift-ate 1 -o out.tum"),
    ];
    let mut seed = seed(files, &calls.each_ref().map(String::as_str));
    // `dmp truth` and `dmp simulate errors` ask for stamps that these have not got, or for another format.
    if to != "tum" {
        seed.calls.retain(|call| call.words[0] != "truth" && call.words[0] != "simulate");
    }
    if to == "kitti" || to == "redwood" {
        seed.calls.retain(|call| !call.words.iter().any(|word| word == "--between"));
    }
    Ok(seed)
}

fn of_others(shop: &Shop<'_>, end: &str) -> anyhow::Result<Vec<Seed>> {
    let form = if end == "npy" { Form::Headed } else { Form::Text };
    let mut seeds = Vec::new();
    for name in shop.names_of_others("trajectories", &format!(".{end}"))? {
        if name.starts_with("not_poses") {
            continue;
        }
        let run = shop.of_others(&format!("trajectories/{name}"), &format!("run.{end}"), form)?;
        let call = format!("convert trajectory run.{end} -o out.txt --to kitti");
        let info = format!("info t.mcap -t run.{end} --json");
        seeds.push(seed(vec![run, shop.made("t.mcap", None)?], &[&call, &info]));
    }
    Ok(seeds)
}

fn calibration(shop: &Shop<'_>) -> anyhow::Result<Seed> {
    let calib = "P0: 718 0 607 0 0 718 185 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n";
    let raw = "calib_time: 15-Mar-2012 11:37:16\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.1 -0.3\n";
    let text =
        |path: &str, text: &str| File { path: path.into(), bytes: text.into(), form: Some(Form::Text) };
    let files = vec![
        shop.made("t.mcap", None)?,
        shop.made("t.tum", None)?,
        text("calib.txt", calib),
        text("raw.txt", raw),
    ];
    let calls = [
        "score t.mcap -t t.tum --extrinsic calib:calib.txt --json --quiet",
        "score t.mcap -t t.tum --extrinsic calib:raw.txt --json --quiet",
        "score t.mcap -t t.tum --json --quiet",
    ];
    Ok(seed(files, &calls))
}

fn graph(shop: &Shop<'_>) -> anyhow::Result<Seed> {
    shop.make("simulate loops q.tum -o loops --spacing 3 --true 1 --false 0 --near 0")?;
    let mut files = vec![shop.made("q.mcap", None)?];
    for name in ["graph.g2o", "candidates.g2o", "labels.csv", "keyframes.txt"] {
        files.push(shop.made(&format!("loops/{name}"), Form::Text)?);
    }
    let asked = "loops loops/graph.g2o --candidates loops/candidates.g2o";
    let with_log = "--log q.mcap --keyframes loops/keyframes.txt --truth loops/labels.csv --json --quiet";
    let calls = [
        format!("{asked} --json --quiet"),
        format!("{asked} {with_log}"),
        format!("{asked} --accept --save-graph out.g2o -o out.g2o"),
    ];
    let mut seed = seed(files, &calls.each_ref().map(String::as_str));
    let accept = &mut seed.calls[2];
    accept.words.truncate(accept.words.len() - 2);
    Ok(seed)
}

fn result(shop: &Shop<'_>) -> anyhow::Result<Seed> {
    let mut files = vec![shop.made("t.mcap", None)?, shop.made("t.tum", None)?];
    for (path, run) in [("one.json", "one=t.tum"), ("other.json", "other=t.tum")] {
        let bytes = shop.make(&format!("score t.mcap -t {run} -t again=t.tum --json --quiet"))?;
        files.push(File { path: path.into(), bytes, form: Some(Form::Json) });
    }
    let calls = [
        "compare one.json other.json --json",
        "compare one.json other.json -v",
        "compare one.json other.json --report out.html -o out.html",
        "compare one.json --fail-above R_cv_10=9m",
        "score t.mcap -t t.tum --like one.json --json --quiet",
    ];
    let mut seed = seed(files, &calls);
    let page = &mut seed.calls[2];
    page.words.truncate(page.words.len() - 2);
    Ok(seed)
}
