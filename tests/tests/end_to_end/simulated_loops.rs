//! `dmp simulate loops`: what it writes is read back as what it says it is.

use dmp_log::{
    read_keyframe_times, read_loop_candidates, read_loop_labels, read_pose_graph, read_trajectory,
};

use crate::common::{dmp, refused, text};

const FILES: [&str; 5] = ["graph.g2o", "candidates.g2o", "labels.csv", "keyframes.txt", "truth.tum"];

#[test]
fn a_graph_its_candidates_and_their_labels_belong_together() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str| {
        let output = dmp(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}\n{}", text(&output.stderr));
        text(&output.stdout)
    };
    // Twice round the same blocks; the folder of scans has their times beside them.
    run("simulate town -o drive --scans 500 --azimuth-steps 60 --seed 3");
    let make = "simulate loops drive.truth.tum --keyframes drive/times.txt --spacing 0.9m --near 4";
    let told = run(&format!("{make} -o loops"));

    let at = |name: &str| folder.path().join("loops").join(name);
    let file = read_pose_graph(&at("graph.g2o")).unwrap();
    assert!(file.has_information && file.graph.check_connected(&[]).is_ok());
    let vertices = file.graph.ids().len();
    assert!((100..250).contains(&vertices), "{vertices}");
    let found = read_loop_candidates(&at("candidates.g2o"), &file).unwrap();
    assert_eq!((found.candidates.len(), found.skipped.len()), (24, 0));
    let labels = read_loop_labels(&at("labels.csv")).unwrap();
    assert_eq!((labels.labels.len(), labels.repeated), (24, 0));
    let is_true = |edge: &dmp_sensor::PoseEdge| labels.of(edge.to, edge.from).unwrap();
    assert_eq!(found.candidates.iter().filter(|candidate| is_true(&candidate.edge)).count(), 10);

    // The vertices are scans of the log, and each has its true pose.
    let stamps_ns = read_keyframe_times(&at("keyframes.txt")).unwrap().of_vertices(file.graph.ids()).unwrap();
    let of_scans = read_keyframe_times(&folder.path().join("drive/times.txt")).unwrap();
    assert!(stamps_ns.iter().all(|stamp_ns| of_scans.stamps_ns.binary_search(stamp_ns).is_ok()));
    let truth = read_trajectory(&at("truth.tum")).unwrap().trajectory;
    assert_eq!(truth.stamps_ns().unwrap(), stamps_ns);
    assert_eq!(read_keyframe_times(&at("truth.tum")).unwrap().stamps_ns, stamps_ns);
    // A true candidate is near what it measures, another one is not.
    for candidate in &found.candidates {
        let edge = &candidate.edge;
        let pose = |id| truth.poses()[file.graph.index_of(id).unwrap()];
        let truly = pose(edge.from).inv_mul(&pose(edge.to));
        let off_m = (edge.from_from_to.translation.vector - truly.translation.vector).norm();
        assert_eq!(off_m < 1.0, is_true(edge), "{off_m} m");
    }

    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines.len(), FILES.len(), "{told}");
    for (line, name) in lines.iter().zip(FILES) {
        assert!(line.contains(name), "{told}");
    }
    assert!(lines[0].contains(&format!("{vertices} vertices, {} edges", vertices - 1)), "{told}");
    assert!(lines[2].contains("10 true, 10 false, 4 near"), "{told}");

    run(&format!("{make} -o again"));
    run(&format!("{make} -o other --seed 2"));
    let read = |from: &str, name: &str| std::fs::read(folder.path().join(from).join(name)).unwrap();
    assert!(FILES.iter().all(|name| read("loops", name) == read("again", name)));
    assert!(FILES[..3].iter().all(|name| read("loops", name) != read("other", name)));

    let in_place = "simulate loops loops/truth.tum --true 2 --false 2 --near 0 -o loops";
    refused(folder.path(), in_place, 2, &["loops/truth.tum", "the place of the input"]);
    let too_many = format!("{make} --true 5000 -o none");
    refused(folder.path(), &too_many, 1, &["5004 true and near loops", "within 8 m"]);
    refused(folder.path(), &format!("{make} --noise=-1,0deg -o none"), 2, &["the noise in m", "-1"]);
    assert!(!folder.path().join("none").exists());
}
