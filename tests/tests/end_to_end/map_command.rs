//! `dmp map`: built, looked at, checked, exported; damaged and refused.

use dmp_log::{LogError, read_cloud};

use crate::common::{done, ends, has, json, misused, once, refused, sample_rows, text, tum, write};

/// Builds the map of the sample's truth, `truth.dmpmap`.
pub(crate) const BUILD: &str = "map build @/town.mcap -t @/truth.tum -o truth.dmpmap --quiet";

#[test]
fn a_built_map_is_the_one_that_a_score_makes() {
    let built = once(BUILD);
    let info = json(&built.folder, "map info truth.dmpmap");
    let report = once(&format!("{} --json --quiet", crate::common::TWO)).json();
    let of_run = |field: &str| report["runs"][0][field].as_u64().unwrap();
    assert_eq!(info["surfels"], of_run("surfels") - of_run("surfels_contradicted"));
    assert_eq!(info["voxel_m"], report["config"]["voxel_m"]);
    has(info["provenance"].as_str().unwrap(), &["town.mcap"]);
    assert!(info["segments"][1].as_i64().unwrap() > info["segments"][0].as_i64().unwrap());
    let [low, high] = [0, 1].map(|k| info["extent_m"][k][0].as_f64().unwrap());
    assert!(high - low > 100.0 && high - low < 1000.0, "{low} to {high}");
}

#[test]
fn a_cloud_alone_is_as_thick_as_the_map_of_its_log() {
    let scored = once("score @/town.mcap -t @/truth.tum --voxel 0.5 --residuals returns.laz --json --quiet");
    let (path, of_log) = (scored.folder.as_path(), scored.json()["runs"][0]["thickness"].clone());
    let check = "map check returns.laz --voxel 0.5 --report page.html";
    let found = json(path, check);
    let metres = |thickness: &serde_json::Value, field: &str| thickness[field].as_f64().unwrap();
    let [log_m, cloud_m] = [&of_log, &found["thickness"]].map(|thickness| metres(thickness, "median_m"));
    assert!((cloud_m / log_m - 1.0).abs() < 0.1, "{cloud_m} m, {log_m} m in the log");
    // The sensor has a noise of 2 cm along the ray, and sees the ground from the side.
    assert!((0.002..0.02).contains(&log_m), "{log_m} m");
    assert_eq!(of_log["layers"]["doubled"], 0);
    assert_eq!(found["points"], 309_402);
    assert!(of_log["sensor_median_m"].is_number() && found["thickness"]["sensor_median_m"].is_null());
    has(
        &text(&std::fs::read(path.join("page.html")).unwrap()),
        &["How good is returns.laz?", "data:image/png"],
    );
    has(
        &done(path, check),
        &["thickness", "(median), 95 % of the flat cells below", "double layers", "holes"],
    );
}

#[test]
fn what_has_no_points_is_not_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "floor.obj", "v 0 0 0\nv 9 0 0\nv 9 9 0\nf 1 2 3\n");
    misused(path, "map check floor.obj", &["floor.obj: a mesh has surfaces without thickness"]);
    once(BUILD).copy("truth.dmpmap", path);
    misused(path, "map export truth.dmpmap -o a.copc.laz", &["COPC is read, not written"]);
    has(
        &done(path, "map check truth.dmpmap"),
        &["thickness      not known: a store holds one disc for each voxel"],
    );
    let [store, info] = ["check", "info"].map(|what| json(path, &format!("map {what} truth.dmpmap")));
    assert_eq!((&store["surfels"], &store["thickness"]), (&info["surfels"], &serde_json::Value::Null));
    assert!(store["holes"]["covered_m2"].as_f64() > Some(1000.0), "{store}");
    done(path, "map export truth.dmpmap -o a.las --crs EPSG:32632 --quiet");
    let las = las::Reader::from_path(path.join("a.las")).unwrap();
    let wkt = text(las.header().get_wkt_crs_bytes().unwrap());
    assert!(las.header().has_wkt_crs() && wkt.starts_with("PROJCS[\"WGS 84 / UTM zone 32N\""), "{wkt}");
    misused(path, "map export truth.dmpmap -o a.ply --crs EPSG:32632", &["names no coordinate system"]);
    misused(path, "map export truth.dmpmap -o a.laz --crs EPSG:4326", &["its axes must be in metres"]);
    write(
        path,
        "few.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n",
    );
    has(&done(path, "map check few.ply"), &["1 point", "thickness      not known: too few flat cells"]);
    let found = json(path, "map check few.ply");
    assert_eq!((&found["thickness"], &found["holes"]["count"]), (&serde_json::Value::Null, &0.into()));
}

#[test]
fn messages_of_a_build_name_the_run_and_the_file_that_were_given() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut rows = sample_rows("truth.tum");
    rows.iter_mut().for_each(|row| row[0] += 7000.0);
    write(path, "far.tum", &tum(&rows));
    let apart = crate::common::dmp(path, "map build @/town.mcap -t far.tum -o far.dmpmap");
    has(&text(&apart.stderr), &["--time-offset far=7000.000"]);
    done(path, "map build @/town.mcap -t far.tum --time-offset far=7000 -o far.dmpmap");

    write(path, "floor.obj", "v 0 0 0\nv 9 0 0\nv 9 9 0\nf 1 2 3\n");
    let built = text(&ends(path, "map build floor.obj -o floor.dmpmap", 0).stderr);
    assert_eq!(built.matches("OBJ mesh of 1 triangle").count(), 1, "{built}");
    has(&built, &["map of `floor.obj`: "]);
}

#[test]
fn every_format_holds_every_surfel_and_a_box_those_in_it() {
    let folder = tempfile::tempdir().unwrap();
    once(BUILD).copy("truth.dmpmap", folder.path());
    let surfels = json(folder.path(), "map info truth.dmpmap")["surfels"].as_u64().unwrap();
    let read = |file: &str| {
        let mut points: Vec<[f64; 3]> = Vec::new();
        let sink = |batch: &[[f64; 3]]| {
            points.extend_from_slice(batch);
            Ok::<(), LogError>(())
        };
        read_cloud(&folder.path().join(file), None, sink).unwrap();
        points
    };
    let export =
        |arguments: &str| drop(done(folder.path(), &format!("map export truth.dmpmap {arguments} --quiet")));
    let mut first: Option<Vec<[f64; 3]>> = None;
    for file in ["a.ply", "a.pcd", "a.las", "a.laz"] {
        export(&format!("-o {file}"));
        let points = read(file);
        assert_eq!(points.len() as u64, surfels, "{file}");
        let first = first.get_or_insert_with(|| points.clone());
        let apart = first.iter().zip(&points).flat_map(|(a, b)| (0..3).map(move |k| (a[k] - b[k]).abs()));
        assert!(apart.fold(0.0, f64::max) <= 0.5001e-4, "{file}");
    }
    let all = first.unwrap();
    // Around some surfel, over the borders of tiles.
    let [x, y] = [0, 1].map(|k| all[all.len() / 2][k].round());
    let (xs, ys) = (x - 20.0..=x + 20.5, y - 15.0..=y + 30.0);
    export(&format!("-o box.ply --box {},{},{},{}", xs.start(), ys.start(), xs.end(), ys.end()));
    let inside = |p: &&[f64; 3]| xs.contains(&p[0]) && ys.contains(&p[1]);
    let expected: Vec<[f64; 3]> = all.iter().filter(inside).copied().collect();
    let found = read("box.ply");
    assert!(expected.len() > 100 && expected.len() < all.len() / 2, "{} of {}", expected.len(), all.len());
    assert!(found == expected, "{} for {}", found.len(), expected.len());

    // A cloud becomes a map again.
    done(folder.path(), "map build a.laz -o again.dmpmap --voxel 1");
    let info = json(folder.path(), "map info again.dmpmap");
    assert!(info["surfels"].as_u64().unwrap() > 1000 && info["segments"].is_null());
    has(info["provenance"].as_str().unwrap(), &["a.laz"]);
}

#[test]
fn damage_is_named_tile_by_tile_and_misuse_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    once(BUILD).copy("truth.dmpmap", path);
    let tiles = json(path, "map info truth.dmpmap")["tiles"].as_u64().unwrap();
    has(&done(path, "map verify truth.dmpmap"), &["sound"]);
    let mut bytes = std::fs::read(path.join("truth.dmpmap")).unwrap();
    // Somewhere among the blobs, twice.
    let (a, b) = (bytes.len() / 5, bytes.len() / 2);
    bytes[a] ^= 1;
    bytes[b] ^= 0x80;
    std::fs::write(path.join("bad.dmpmap"), &bytes).unwrap();
    let output = ends(path, "map verify bad.dmpmap", 3);
    let stderr = text(&output.stderr);
    let damaged = stderr.lines().filter(|line| line.starts_with("error: bad.dmpmap: tile ("));
    assert_eq!(damaged.count(), 2, "{stderr}");
    has(&text(&output.stdout), &[&format!("2 of {tiles} tiles damaged")]);
    for (arguments, code, words) in [
        ("export bad.dmpmap -o x.ply", 1, ["bad.dmpmap: tile (", "checksum"]),
        ("info @/town.mcap", 1, ["town.mcap: not a map store", ""]),
        ("export truth.dmpmap -o x.xyz", 2, ["x.xyz", ".laz, .las, .ply or .pcd"]),
        ("build @/town.mcap -o x.dmpmap", 2, ["town.mcap", "-t RUN.tum"]),
    ] {
        refused(path, &format!("map {arguments}"), code, &words);
    }
    misused(path, "map export truth.dmpmap -o x.ply --box 1,2,1,4", &["--box"]);
    assert!(!path.join("x.ply").exists() && !path.join("x.dmpmap").exists());
}
