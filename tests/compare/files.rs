//! Tests the file of runs: it has the same bytes on any number of cores, in parts, and after a kill.

use crate::{CONDITIONS, arm, committed, study};
use dq_kinematics::control::Law;
use dq_studies::compare::{Arm, CompareError, Findings, Gain, Part, Peers, Study, Summary, latex, page};
use std::fs;
use std::path::{Path, PathBuf};

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

fn write(study: &Study, file: &Path, part: u64, parts: u64) {
    study.write(file, format!("{part}/{parts}").parse().unwrap(), |_| {}).unwrap();
}

/// Writes a study with all its runs to a file.
fn written(study: Study) -> (Study, Folder, PathBuf) {
    let folder = Folder::new();
    let file = folder.file("compare.jsonl");
    write(&study, &file, 1, 1);
    (study, folder, file)
}

#[test]
fn joined_parts_have_the_same_bytes_as_one_run_on_one_core() {
    let (study, folder) = (study(1, 3), Folder::new());
    let whole = folder.file("compare.jsonl");
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one.install(|| write(&study, &whole, 1, 1));
    let mut together = Vec::new();
    for part in 1..=3 {
        let file = folder.file(&format!("compare-{part}-of-3.jsonl"));
        write(&study, &file, part, 3);
        together.extend(fs::read(file).unwrap());
    }
    assert_eq!(fs::read(&whole).unwrap(), together);
    let cells = Summary::read(&study, &whole).unwrap().cells(1.96);
    // There is a cell for each arm, law and condition, and one for all arms together.
    assert_eq!(cells.len(), 2 * Law::ALL.len() * CONDITIONS);
    assert_eq!(cells.iter().map(|cell| cell.runs as u64).sum::<u64>(), 2 * study.run_count());
}

#[test]
fn parts_are_checked_and_joined() {
    let (study, folder) = (study(1, 3), Folder::new());
    let (whole, merged) = (folder.file("whole.jsonl"), folder.file("compare.jsonl"));
    write(&study, &whole, 1, 1);
    let part = |number: u64| folder.file(&format!("compare-{number}-of-3.jsonl"));
    let merge = || study.merge(folder.0.path(), 3, &merged).unwrap_err().to_string();
    (1..3).for_each(|number| write(&study, &part(number), number, 3));
    assert!(merge().contains("compare-3-of-3.jsonl: No such file"), "{}", merge());
    fs::copy(part(2), part(3)).unwrap();
    assert!(merge().contains("compare-3-of-3.jsonl: line 1 is of another run"), "{}", merge());
    fs::write(part(3), "").unwrap();
    assert!(merge().contains("compare-3-of-3.jsonl: 0 runs, expected 56"), "{}", merge());
    assert!(!merged.exists(), "nothing is put together before all are right");
    write(&study, &part(3), 3, 3);
    study.merge(folder.0.path(), 3, &merged).unwrap();
    assert_eq!(fs::read(&whole).unwrap(), fs::read(&merged).unwrap());
}

/// Runs of an older program, or of a machine with other rounding: one digit of one task differs.
#[test]
fn runs_that_this_program_would_not_make_are_not_continued() {
    let (study, _folder, file) = written(study(1, 3));
    let text = fs::read_to_string(&file).unwrap();
    let mut lines: Vec<_> = text.split_inclusive('\n').map(str::to_owned).collect();
    let line = &mut lines[40];
    let at = line.find("\"effort\":").unwrap() + 10;
    let other = if line.as_bytes()[at] == b'1' { "2" } else { "1" };
    line.replace_range(at..=at, other);
    fs::write(&file, lines.concat()).unwrap();
    let why = study.write(&file, Part::WHOLE, |_| {}).unwrap_err().to_string();
    assert!(why.contains("line 41 is of another run"), "{why}");
}

#[test]
fn a_study_continues_after_a_kill() {
    let (study, _folder, file) = written(study(1, 3));
    let whole = fs::read(&file).unwrap();
    for cut in [0, 1, whole.len() / 3, whole.len() - 1] {
        fs::write(&file, &whole[..cut]).unwrap();
        write(&study, &file, 1, 1);
        assert_eq!(fs::read(&file).unwrap(), whole, "cut at {cut}");
    }
    write(&study, &file, 1, 1);
    assert_eq!(fs::read(&file).unwrap(), whole, "nothing is left to do");
}

#[test]
fn a_file_of_another_study_is_not_continued() {
    let (one, _folder, file) = written(study(1, 3));
    let before = fs::read(&file).unwrap();
    for other in [study(1, 4), study(2, 3)] {
        let why = other.write(&file, Part::WHOLE, |_| {}).unwrap_err();
        assert!(matches!(why, CompareError::OtherRuns { .. }), "{why}");
    }
    let summary = |text: &[u8]| {
        fs::write(&file, text).unwrap();
        Summary::read(&one, &file).unwrap_err().to_string()
    };
    // Cut in the middle of a line.
    let half = before.len() / 2 + usize::from(before[before.len() / 2 - 1] == b'\n');
    assert!(summary(&before[..half]).contains("is damaged: delete it"));
    let first = before.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    let last = before[..before.len() - 1].iter().rposition(|byte| *byte == b'\n').unwrap() + 1;
    assert!(summary(&before[first..]).contains("line 1 is of another run"));
    assert!(summary(&before[..last]).contains("167 runs, expected 168"));
    assert!(summary(&[&before[..], &before[last..]].concat()).contains("line 169 is of another run"));
}

/// Damage by disks is reported with its line and a remedy before any work is done.
#[test]
fn damaged_lines_are_reported() {
    let (study, _folder, file) = written(study(1, 3));
    let whole = fs::read_to_string(&file).unwrap();
    let lines: Vec<_> = whole.split_inclusive('\n').collect();
    let half = &lines[3][..20];
    for bad in ["\n", "\0\0\0\n", half, "{}{}\n", "{}\n", &format!("{half}\n"), "{\"task\":5,}\n"] {
        let text = [&lines[..3], &[bad], &lines[4..]].concat().concat();
        fs::write(&file, &text).unwrap();
        let done = |_| panic!("nothing is done");
        let why = study.write(&file, Part::WHOLE, done).unwrap_err().to_string();
        assert!(why.contains("compare.jsonl: line 4 is damaged: delete it"), "{bad:?}: {why}");
        assert_eq!(fs::read_to_string(&file).unwrap(), text);
    }
    // Follow the advice of the message.
    fs::write(&file, lines[..3].concat()).unwrap();
    write(&study, &file, 1, 1);
    assert_eq!(fs::read_to_string(&file).unwrap(), whole);
}

/// Each value that a line stores about its run is changed in turn; both ends of the run stay correct.
#[test]
fn misplaced_lines_are_reported() {
    let (study, _folder, file) = written(study(2, 3));
    let text = fs::read_to_string(&file).unwrap();
    let lines: Vec<_> = text.split_inclusive('\n').collect();
    // The exchanged runs are those of the next task, the next condition, and the next law.
    for (one, other) in [(2, 3), (2, 4), (2, 2 + 2 * CONDITIONS)] {
        let mut moved = lines.clone();
        moved.swap(one, other);
        fs::write(&file, moved.concat()).unwrap();
        let why = study.write(&file, Part::WHOLE, |_| {}).unwrap_err().to_string();
        assert!(why.contains("line 3 is of another run"), "{one}, {other}: {why}");
    }
}

#[test]
fn two_arms_with_one_name_are_refused() {
    let why = Study::new(vec![arm("ur5e"), arm("ur5e")], vec![Law::Logc], 1, 1).unwrap_err();
    assert!(why.to_string().contains("\"ur5e\""));
}

/// The committed gains are valid for these arms in this order, and for this program.
#[test]
fn gains_that_were_chosen_are_kept_and_those_of_another_program_refused() {
    let (folder, chosen) = (Folder::new(), committed().gains);
    let file = folder.file("gains.json");
    let study = |gains: &[Gain]| {
        fs::write(&file, serde_json::to_string(gains).unwrap()).unwrap();
        let mut study = Study::new(Arm::builtin().unwrap(), Law::ALL.to_vec(), 1, 1).unwrap();
        study.read_gains(&file).map(|()| study.gains)
    };
    assert_eq!(study(&chosen).unwrap(), chosen);
    let mut older = chosen.clone();
    older[3].target *= 1.001;
    for other in [&older[..], &chosen[1..], &[]] {
        let why = study(other).unwrap_err().to_string();
        assert!(why.contains("delete it to choose the gains again"), "{why}");
    }
}

/// A study of two laws has only their runs. Without the reference law, they are compared with the first of them.
#[test]
fn a_study_may_have_some_of_the_laws() {
    let laws = vec![Law::Diffc, Law::DiffcInverse];
    let (study, folder, file) = written(Study { laws: laws.clone(), ..study(2, 3) });
    let rows = folder.file("compare.csv");
    study.write_csv(&file, &rows).unwrap();
    let text = fs::read_to_string(rows).unwrap();
    let columns = |line: &str| line.split(',').count();
    assert_eq!(text.lines().count() as u64, 1 + study.run_count());
    assert!(text.lines().all(|line| columns(line) == 13), "{text}");
    assert_eq!(text.matches("settling_time,diffc_inverse,puma560,").count(), 2 * 12);
    assert_eq!(study.baseline(), Law::Diffc);
    let mut study = study;
    study.gains.retain(|gain| laws.iter().any(|law| law.name() == gain.law));
    let summary = Summary::read(&study, &file).unwrap();
    let findings = Findings::new(&study, &summary, &Peers::default()).unwrap();
    assert_eq!((findings.laws(), findings.baseline()), (vec!["diffc", "diffc_inverse"], "diffc"));
    assert!(!findings.comparisons.is_empty());
    assert!(findings.comparisons.iter().all(|compared| compared.laws.contains(&"diffc".to_owned())));
    let page = page(&findings);
    assert!(page.contains("| less `diffc` |") && !page.contains("| logc |"), "{page}");
    let latex = latex(&findings);
    assert_eq!(latex.matches("\\begin{tabular}").count(), page.matches("\n## ").count());
    assert!(latex.contains("diffc\\_inverse & ") && !latex.contains('²'), "{latex}");
}

/// The estimate is of the right order of magnitude: as many runs take as long as estimated, up to the load of the machine.
#[test]
fn an_estimate_is_near_the_time_that_the_runs_take() {
    let (study, folder) = (study(6, 3), Folder::new());
    let estimate = study.estimate("1/1".parse().unwrap(), 0).unwrap();
    let part = study.estimate("1/2".parse().unwrap(), 0).unwrap();
    let begin = std::time::Instant::now();
    write(&study, &folder.file("compare.jsonl"), 1, 2);
    let taken = begin.elapsed();
    assert!(part < 4 * taken && taken < 4 * part, "{part:?} {taken:?}");
    assert!(estimate > part && study.estimate("1/2".parse().unwrap(), study.run_count()).unwrap() < part);
}
