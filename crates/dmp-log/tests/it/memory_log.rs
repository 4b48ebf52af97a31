use crate::common::{open, read_all, scan, scans, write_mcap};
use dmp_log::{
    FrameInfo, LogFormat, LogOptions, McapCompression, MemoryLog, MemoryLogFault, ScanLog as _, outline_log,
};
use dmp_sensor::Scan;

#[test]
fn scans_in_memory_are_those_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    for with_times in [false, true] {
        let mut written = scans(12, 300, with_times);
        written[5] = scan(5, 0, false);
        write_mcap(&path, &written, McapCompression::Zstd);
        let (file, memory) = (open(&path), MemoryLog::new("drive", written.clone()).unwrap());
        assert!(read_all(&memory) == read_all(&*file));
        assert_eq!(memory.frames(), file.frames());
        assert_eq!((memory.scans_in_log(), memory.number_in_log(7)), (12, 7));
        let groups = |log: &dyn dmp_log::ScanLog| log.groups().into_iter().flatten().collect::<Vec<_>>();
        assert_eq!(groups(&memory), groups(&*file));
        let (of_memory, of_file) = (memory.summary(), file.summary());
        assert_eq!(of_memory.format, LogFormat::Memory);
        assert_eq!(of_memory.has_point_times(), of_file.has_point_times());
        assert_eq!(of_memory.returns, of_file.returns);
        assert_eq!(
            (of_memory.span_ns, of_memory.period_ns, of_memory.middle_ns),
            (of_file.span_ns, of_file.period_ns, of_file.middle_ns)
        );
    }
}

#[test]
fn a_part_in_memory_is_that_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let written = scans(20, 100, true);
    write_mcap(&path, &written, McapCompression::None);
    let file = outline_log(&path, &LogOptions::default()).unwrap();
    let wanted = [2, 3, 11, 19];
    assert_eq!((file.scans().len(), file.period_ns()), (20, Some(100_000_000)));
    for part in [file.open(&wanted).unwrap(), Box::new(file.load(&wanted).unwrap())] {
        assert_eq!((0..4).map(|frame| part.number_in_log(frame)).collect::<Vec<_>>(), wanted);
        assert_eq!(part.scans_in_log(), 20);
        assert!(read_all(&*part).iter().eq(wanted.iter().map(|&k| &written[k])));
    }
}

#[test]
fn the_fingerprint_is_that_of_all_that_is_held() {
    let fingerprint = |scans: Vec<Scan>| MemoryLog::new("a", scans).unwrap().summary().fingerprint.clone();
    let all = || scans(3, 50, true);
    let changed = |change: fn(&mut Scan)| {
        let mut scans = all();
        change(&mut scans[1]);
        fingerprint(scans)
    };
    assert_eq!(fingerprint(all()), fingerprint(all()));
    let prints = [
        fingerprint(all()),
        fingerprint(scans(3, 50, false)),
        changed(|scan| scan.points_in_sensor_m[7][2] += 0.5),
        changed(|scan| scan.time_offsets_ns[49] += 1),
        changed(|scan| scan.stamp_ns = scan.stamp_ns.map(|stamp_ns| stamp_ns + 1)),
    ];
    let several: std::collections::BTreeSet<_> = prints.iter().collect();
    assert_eq!(several.len(), prints.len());
}

#[test]
fn what_makes_no_log_is_refused() {
    let fault = |change: fn(&mut Vec<Scan>)| {
        let mut scans = scans(4, 10, true);
        change(&mut scans);
        MemoryLog::new("a", scans).unwrap_err()
    };
    assert_eq!(fault(Vec::clear), MemoryLogFault::NoScans);
    assert_eq!(
        fault(|scans| scans[2].time_offsets_ns.truncate(9)),
        MemoryLogFault::TimesMismatch { scan: 2, points: 10, times: 9 }
    );
    assert_eq!(
        fault(|scans| scans[0].stamp_ns = None),
        MemoryLogFault::PartlyStamped { with: 1, without: 0 }
    );
    assert_eq!(
        fault(|scans| scans[3].time_offsets_ns.clear()),
        MemoryLogFault::PartlyTimed { with: 0, without: 3 }
    );
    assert_eq!(
        fault(|scans| scans[1].time_offsets_ns[4] = i64::MAX),
        MemoryLogFault::TimeOutOfRange { scan: 1, point: 4, offset_ns: i64::MAX }
    );
}

#[test]
fn a_log_without_stamps_is_taken_as_it_is() {
    let mut scans = scans(4, 10, false);
    scans.iter_mut().for_each(|scan| scan.stamp_ns = None);
    let log = MemoryLog::new("rooms", scans).unwrap();
    assert_eq!(log.frames()[0], FrameInfo { stamp_ns: None, returns: 10 });
    let summary = log.summary();
    assert_eq!((summary.span_ns, summary.period_ns, summary.middle_ns), (None, None, 0));
    assert_eq!(summary.bytes, 4 * 10 * 12);
    let error = log.reader().unwrap().read(4, &mut Scan::default()).unwrap_err().to_string();
    assert_eq!(error, "rooms: frame 4: the log has 4 scans");
}
