//! Logs that are folders of files, a scan or a depth image each, and logs in world coordinates.

use crate::trials::{Form, Kind, Seed, Shop, seed};

pub(super) fn kinds(shop: &Shop<'_>) -> anyhow::Result<Vec<Kind>> {
    Ok(vec![
        Kind { name: "folder of .bin", seeds: vec![folder(shop, "bin")?] },
        Kind { name: "folder of .pcd", seeds: folder_and_others(shop, "pcd", "open3d_ascii.pcd")? },
        Kind { name: "folder of .ply", seeds: folder_and_others(shop, "ply", "plyfile_float64_ascii.ply")? },
        Kind { name: "folder of .las", seeds: vec![folder(shop, "las")?] },
        Kind { name: "folder of .laz", seeds: vec![folder(shop, "laz")?] },
        Kind { name: "LAS in world coordinates", seeds: vec![world(shop, "las")?] },
        Kind { name: "LAZ in world coordinates", seeds: vec![world(shop, "laz")?] },
        Kind { name: "depth images", seeds: vec![depth(shop)?] },
    ])
}

fn form(name: &str) -> Option<Form> {
    Some(match name.rsplit('.').next()? {
        "pcd" | "ply" => Form::Headed,
        "las" | "laz" => Form::Las,
        "txt" => Form::Text,
        "json" => Form::Json,
        "png" => Form::Png,
        _ => Form::Bytes,
    })
}

/// The town in a folder.
fn folder(shop: &Shop<'_>, to: &str) -> anyhow::Result<Seed> {
    shop.make(&format!("convert log t.mcap -o {to} --to {to}"))?;
    let mut files = shop.made_folder(to, form)?;
    files.push(shop.made("t.tum", None)?);
    let calls = [
        format!("info {to} --json"),
        format!("score {to} -t t.tum --json --quiet"),
        format!("map build {to} -t t.tum -o out.dmpmap => map verify out.dmpmap"),
        format!("convert log {to} -o out.mcap => info out.mcap"),
    ];
    Ok(seed(files, &calls.each_ref().map(String::as_str)))
}

/// The same, and a folder with one file of other software in text.
fn folder_and_others(shop: &Shop<'_>, to: &str, of_others: &str) -> anyhow::Result<Vec<Seed>> {
    let mut seeds = vec![folder(shop, to)?];
    let mut names = shop.names_of_others("clouds", to)?;
    names.retain(|name| {
        name == of_others || name.contains("_compressed") || name.contains("big") && !name.contains("mesh")
    });
    for name in names {
        let scan = shop.of_others(&format!("clouds/{name}"), &format!("scans/0.{to}"), Form::Headed)?;
        let calls =
            ["info scans --json", "convert log scans --point-time ignore -o out --to ply => info out"];
        seeds.push(seed(vec![scan], &calls));
    }
    Ok(seeds)
}

fn world(shop: &Shop<'_>, to: &str) -> anyhow::Result<Seed> {
    shop.make(&format!("score t.mcap -t t.tum --residuals world.{to} --quiet"))?;
    let files = vec![shop.made(&format!("world.{to}"), Form::Las)?, shop.made("t.tum", None)?];
    let calls = [
        format!("info world.{to} --made-with t.tum --json"),
        format!("score world.{to} --made-with t.tum -t t.tum --json --quiet"),
        format!("convert log world.{to} --made-with t.tum -o out.mcap => info out.mcap"),
    ];
    Ok(seed(files, &calls.each_ref().map(String::as_str)))
}

fn depth(shop: &Shop<'_>) -> anyhow::Result<Seed> {
    let mut files = shop.made_folder("room", |name| {
        // The surface and the trajectories are kinds of their own.
        form(name).filter(|_| ["png", "json"].iter().any(|end| name.ends_with(end)) || name == "depth.txt")
    })?;
    let calls = [
        "info room --json",
        "score room -t room/groundtruth.txt --json --quiet",
        "map build room -t room/groundtruth.txt -o out.dmpmap => map verify out.dmpmap",
        "convert log room -o out.mcap => info out.mcap",
    ];
    files.retain(|file| file.path != "room/room.obj");
    Ok(seed(files, &calls))
}
