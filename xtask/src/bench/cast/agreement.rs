//! The ranges of all casters beside exact ones.

use dmp_cast::{Grouping, Path};

use super::exact::{Agreement, Exact};
use super::files::Work;
use super::own::{BOUND_M, CasterKind, Mode, Own};
use super::speeds::Casters;

const ANSWERS: [&str; 3] = ["z1", "zn", "zc"];

/// Prints a table of agreements: the project's own in every way, the others' single rays.
pub(super) fn print(own: &mut Own, work: &Work, casters: &mut Casters, exact: &Exact) -> anyhow::Result<()> {
    println!("{:<52}{:<4}{}", "ranges against exact ones", "", Agreement::header());
    let measured_m: Vec<f64> = work.rays.iter().map(|ray| f64::from(ray[6])).collect();
    let bounded = exact.bounded(&measured_m, BOUND_M);
    for (is_bounded, exact, told) in [(false, exact, ""), (true, &bounded, " bounded")] {
        let mut distinct: Vec<(Vec<String>, [Vec<f64>; 3])> = Vec::new();
        for grouping in [Grouping::Single, Grouping::Auto] {
            for path in Path::all() {
                let name = if grouping == Grouping::Single { "single" } else { "packets" };
                let name = format!("{}-{name}{told}", path.name());
                let kind = |three| CasterKind { three, bounded: is_bounded, one_tree: false };
                let ranges = own.ranges(Mode { path, grouping, kind: kind(true), twice: false })?;
                let alone = own.ranges(Mode { path, grouping, kind: kind(false), twice: false })?;
                if !same(&ranges[0], &alone[0]) {
                    println!(
                        "{:<52}{:<4}{}",
                        format!("dmp {name} alone"),
                        "z1",
                        told_of(&alone[0], &exact.0[0])
                    );
                }
                match distinct.iter_mut().find(|(_, known)| (0..3).all(|k| same(&known[k], &ranges[k]))) {
                    Some((names, _)) => names.push(name),
                    None => distinct.push((vec![name], ranges)),
                }
            }
        }
        let ways = 2 * Path::all().len();
        for (names, ranges) in distinct {
            if names.len() == ways {
                let paths: Vec<&str> = Path::all().into_iter().map(Path::name).collect();
                println!("dmp single and packets{told} on {}: the same bits", paths.join(", "));
            } else {
                println!("dmp {}", names.join(", "));
            }
            for ((answer, ranges), exact) in ANSWERS.iter().zip(&ranges).zip(&exact.0) {
                println!("{:<52}{answer:<4}{}", "", told_of(ranges, exact));
            }
        }
    }
    for peer in &mut casters.peers {
        if peer.name() != "dmp" {
            let ranges: Vec<f64> = peer.ranges("single")?.into_iter().map(f64::from).collect();
            let name = format!("{} single", peer.name());
            println!("{name:<52}{:<4}{}", ANSWERS[0], told_of(&ranges, &exact.0[0]));
        }
    }
    Ok(())
}

fn told_of(ranges_m: &[f64], exact_m: &[f64]) -> String {
    Agreement::of(ranges_m, exact_m).row()
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}
