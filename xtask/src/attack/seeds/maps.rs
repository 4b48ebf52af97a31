//! Maps: our own store, clouds and meshes.

use crate::trials::{Form, Kind, Seed, Shop, seed};

pub(super) fn kinds(shop: &Shop<'_>) -> anyhow::Result<Vec<Kind>> {
    Ok(vec![
        Kind { name: "map of our own", seeds: vec![store(shop)?] },
        Kind { name: "PCD, PLY map", seeds: clouds(shop, &["pcd", "ply"], Form::Headed)? },
        Kind { name: "LAS map", seeds: clouds(shop, &["las"], Form::Las)? },
        Kind { name: "LAZ map", seeds: clouds(shop, &["laz"], Form::Las)? },
        Kind { name: "mesh", seeds: meshes(shop)? },
    ])
}

fn store(shop: &Shop<'_>) -> anyhow::Result<Seed> {
    shop.make("map build t.mcap -t t.tum -o map.dmpmap")?;
    shop.make("map export map.dmpmap -o reference.ply")?;
    let files = vec![
        shop.made("map.dmpmap", Form::Store)?,
        shop.made("t.mcap", None)?,
        shop.made("t.tum", None)?,
        shop.made("reference.ply", None)?,
    ];
    let calls = [
        "map info map.dmpmap",
        "map info map.dmpmap --json",
        "map verify map.dmpmap",
        "map export map.dmpmap -o out.ply",
        "map export map.dmpmap -o out.las",
        "score t.mcap -t t.tum --map map.dmpmap --json --quiet",
        "truth smd reference.ply map.dmpmap --json",
    ];
    Ok(Seed { is_guarded: true, ..seed(files, &calls) })
}

/// Clouds of the town, and small ones of other software.
fn clouds(shop: &Shop<'_>, ends: &[&str], form: Form) -> anyhow::Result<Vec<Seed>> {
    let mut seeds = Vec::new();
    for end in ends {
        shop.make(&format!("score t.mcap -t t.tum --residuals cloud.{end} --quiet"))?;
        let files = vec![
            shop.made(&format!("cloud.{end}"), form)?,
            shop.made("t.mcap", None)?,
            shop.made("t.tum", None)?,
        ];
        let mut calls = vec![
            format!("map build cloud.{end} -o out.dmpmap => map verify out.dmpmap"),
            format!("score t.mcap -t t.tum --map cloud.{end} --json --quiet"),
        ];
        if *end != "pcd" {
            calls.push(format!("truth smd cloud.{end} cloud.{end} --json"));
        }
        seeds.push(seed(files, &calls.iter().map(String::as_str).collect::<Vec<_>>()));
        for name in shop.names_of_others("clouds", &format!(".{end}"))? {
            // Degrees are refused whole.
            if name.starts_with("degrees") || name.starts_with("mesh") {
                continue;
            }
            let cloud = shop.of_others(&format!("clouds/{name}"), &format!("cloud.{end}"), form)?;
            let call = format!("map build cloud.{end} -o out.dmpmap => map verify out.dmpmap");
            seeds.push(seed(vec![cloud], &[&call]));
        }
    }
    Ok(seeds)
}

fn meshes(shop: &Shop<'_>) -> anyhow::Result<Vec<Seed>> {
    let mut seeds = Vec::new();
    let of_others = [("mesh", ""), ("clouds", "mesh_")];
    for (folder, start) in of_others {
        for name in shop.names_of_others(folder, "")? {
            let end = name.rsplit('.').next().unwrap_or_default().to_owned();
            if !name.starts_with(start) || !["obj", "ply"].contains(&end.as_str()) {
                continue;
            }
            let form = if end == "obj" { Form::Text } else { Form::Headed };
            let mesh = shop.of_others(&format!("{folder}/{name}"), &format!("mesh.{end}"), form)?;
            let calls = [
                // A mesh may be as large as it says: memory is what it may not take.
                format!("map build mesh.{end} -o out.dmpmap --memory 256MiB => map verify out.dmpmap"),
                format!("truth smd mesh.{end} map.dmpmap --json"),
            ];
            // A map of the mesh itself, so that there is something to measure.
            let path = format!("{folder}-{name}.dmpmap");
            let place = crate::workspace::root().join("tests/conformance").join(folder).join(&name);
            shop.make(&format!("map build {} -o {path}", place.display()))?;
            let mut map = shop.made(&path, None)?;
            map.path = "map.dmpmap".into();
            seeds.push(seed(vec![mesh, map], &calls.each_ref().map(String::as_str)));
        }
    }
    Ok(seeds)
}
