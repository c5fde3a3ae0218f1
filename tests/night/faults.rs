//! No input ends a night: every role of a file times every fault costs a row or a warning, and the others are measured.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::support::{Night, TARGETS, set_card, simulated};
use satphot::base::path_text::path_text;
use satphot::base::progress::{Progress, Silent};
use satphot::config::Config;
use satphot::frames::flat::{BAND_BYTES, MasterFlat};
use satphot::frames::{Detector, classify};
use satphot::pipeline::options::Options;
use satphot::pipeline::products::summary::Summary;
use satphot::pipeline::run::run;
use satphot::simulate::{Scenario, simulate};
use satphot::tables::PhotometryRow;

fn night() -> Night {
    static NIGHT: OnceLock<PathBuf> = OnceLock::new();
    Night::copy_of(NIGHT.get_or_init(|| simulated("night_faults", &[])))
}

/// The frames of a night by role: one of each is damaged.
const ROLES: [(&str, &str); 3] =
    [("flat", "flat_001.fits"), ("stars", "field01_01.fits"), ("target", "target_0003.fits")];

/// A fault, and what it does to a file; the answer is the path of the file then.
type Fault = (&'static str, fn(&Path) -> PathBuf);

/// Faults that files have before the night begins.
const FAULTS: [Fault; 9] = [
    ("not FITS", |path| written(path, b"not FITS")),
    ("empty", |path| written(path, b"")),
    ("cut off in its header", |path| cut(path, 1_000)),
    ("cut off in its pixels", |path| cut(path, 20_000)),
    ("a header of 10^16 pixels", |path| {
        set_card(path, "NAXIS1", Some("100000000"));
        set_card(path, "NAXIS2", Some("100000000"));
        path.into()
    }),
    ("a header of negative size", |path| {
        set_card(path, "NAXIS1", Some("-160"));
        path.into()
    }),
    ("damaged in a packed stream", |path| {
        let packed = path.with_extension("fits.gz");
        std::fs::remove_file(path).unwrap();
        written(&packed, b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\xffdamaged")
    }),
    ("a link to nothing", |path| {
        std::fs::remove_file(path).unwrap();
        std::os::unix::fs::symlink("nowhere.fits", path).unwrap();
        path.into()
    }),
    ("a pipe that nobody writes to", |path| {
        std::fs::remove_file(path).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
        path.into()
    }),
];

fn written(path: &Path, bytes: &[u8]) -> PathBuf {
    std::fs::write(path, bytes).unwrap();
    path.into()
}

fn cut(path: &Path, bytes: u64) -> PathBuf {
    std::fs::OpenOptions::new().write(true).open(path).unwrap().set_len(bytes).unwrap();
    path.into()
}

/// Does something when a stage begins: after the files were surveyed.
struct Saboteur<'a> {
    stage: &'a str,
    act: &'a (dyn Fn() + Sync),
}

impl Progress for Saboteur<'_> {
    fn stage(&self, name: &str, _: usize) {
        if name == self.stage {
            (self.act)();
        }
    }
    fn tick(&self) {}
    fn done(&self) {}
    fn elapsed_s(&self) -> f64 {
        0.0
    }
}

fn reduced_while(n: &Night, progress: &dyn Progress) -> satphot::Result<Summary> {
    run(&n.config()?, &n.options, progress)
}

/// The target frames of a night without faults.
fn undamaged() -> &'static Vec<PhotometryRow> {
    static ROWS: OnceLock<Vec<PhotometryRow>> = OnceLock::new();
    ROWS.get_or_init(|| {
        let n = night();
        n.run().unwrap();
        n.rows()
    })
}

/// The damaged frame is a row with its reason, and the others are as in the night without faults.
fn costs_one_row(n: &Night, damaged: &str, what: &str) {
    let rows = n.rows();
    let of_it: Vec<&PhotometryRow> = rows.iter().filter(|r| r.frame == damaged).collect();
    assert_eq!(of_it.len(), 1, "{what}: {:?}", rows.iter().map(|r| &r.frame).collect::<Vec<_>>());
    assert!(["failed", "rejected"].contains(&of_it[0].status.as_str()), "{what}: {:?}", of_it[0].status);
    assert!(of_it[0].reason.len() > 10, "{what}: \"{}\"", of_it[0].reason);
    let others: Vec<&PhotometryRow> = rows.iter().filter(|r| r.frame != damaged).collect();
    let before: Vec<&PhotometryRow> = undamaged().iter().filter(|r| !damaged.starts_with(&r.frame)).collect();
    assert_eq!(others.len(), before.len(), "{what}: another file has a row or none");
    for (row, was) in others.iter().zip(&before) {
        assert_eq!((&row.frame, &row.status), (&was.frame, &was.status), "{what}: {}", row.reason);
        let off_mag = (row.v_mag.unwrap() - was.v_mag.unwrap()).abs();
        assert!(off_mag < 0.05, "{what}: {} is off by {off_mag:.3} mag", row.frame);
    }
}

fn allowing(n: Night) -> Night {
    n.set("night.max_failed_frac=0.5")
}

#[test]
fn any_fault_of_a_frame_costs_its_row_and_the_night_goes_on() {
    for (role, frame) in ROLES {
        for (fault, damage) in FAULTS {
            let what = format!("{role}, {fault}");
            let n = allowing(night());
            let path = damage(&n.path(frame));
            let summary = n.run().unwrap_or_else(|e| panic!("{what} ended the night: {e}"));
            costs_one_row(&n, &path.file_name().unwrap().to_string_lossy(), &what);
            assert!(summary.poor.is_empty(), "{what}: {:?}", summary.poor);
        }
    }
}

#[test]
fn frames_that_vanish_or_shrink_when_their_stage_begins_cost_a_row() {
    let stages = [("flat", "master flat"), ("stars", "star pointings"), ("target", "target frames")];
    for ((role, frame), (_, stage)) in ROLES.iter().zip(stages) {
        for (fault, damage) in [
            ("vanished", (|path: &Path| std::fs::remove_file(path).unwrap()) as fn(&Path)),
            ("shrank", |path| drop(cut(path, 20_000))),
            ("became a folder", |path| {
                std::fs::remove_file(path).unwrap();
                std::fs::create_dir(path).unwrap();
            }),
        ] {
            let n = allowing(night());
            let path = n.path(frame);
            let what = format!("{role}, {fault}");
            let done = reduced_while(&n, &Saboteur { stage, act: &|| damage(&path) });
            done.unwrap_or_else(|e| panic!("{what} ended the night: {e}"));
            costs_one_row(&n, frame, &what);
        }
    }
}

#[test]
fn files_of_the_configuration_that_vanish_during_the_night_cost_nothing() {
    for stage in ["master flat", "star pointings", "target frames"] {
        for name in ["iss-2025-june.tle", "catalogue.csv", "pipeline.toml"] {
            let n = night();
            let config = n.config().unwrap();
            let act = || std::fs::remove_file(n.path(name)).unwrap();
            run(&config, &n.options, &Saboteur { stage, act: &act })
                .unwrap_or_else(|e| panic!("{name} at {stage}: {e}"));
            let numbers =
                |rows: &[PhotometryRow]| -> Vec<_> { rows.iter().map(|r| (r.v_mag, r.model_v_mag)).collect() };
            assert_eq!(numbers(&n.rows()), numbers(undamaged()), "{name} at {stage}");
        }
    }
}

#[test]
fn a_frame_that_the_memory_given_does_not_hold_is_its_row() {
    // of another size: set aside, whatever its memory
    for (role, frame) in &ROLES[1..] {
        let mut n = allowing(night());
        large(&n.path(frame), (3_200, 2_400));
        n.options.max_memory_bytes = Some(130_000_000);
        n.run().unwrap_or_else(|e| panic!("{role}: {e}"));
        costs_one_row(&n, frame, role);
    }
    // of the same size, but packed as one tile, which has to be decoded as a whole
    let sets = ["frame.nx_px=1400", "frame.ny_px=1100", "target.n=3", "flats.n=0"];
    let whole = Night::copy_of(&simulated("night_large_tile", &sets));
    whole.run().unwrap();
    let mut n = allowing(Night::copy_of(&simulated("night_large_tile_twin", &sets)));
    let frame = TARGETS[1];
    let mb_after = |text: &str, words: &str| -> usize {
        let digits = text.split(words).nth(1).unwrap_or_else(|| panic!("no \"{words}\" in {text}"));
        digits.chars().take_while(char::is_ascii_digit).collect::<String>().parse().unwrap()
    };
    n.options.max_memory_bytes = Some(1);
    let least = mb_after(&n.refusal().1, "at least ");
    n.options.max_memory_bytes = Some(least * 1_000_000);
    let notes = n.run().unwrap().notes.join("\n");
    // what the plain target frames take, where star frames take less
    let mb = if notes.contains("max_memory") { mb_after(&notes, "the largest ") } else { least };
    n.options.max_memory_bytes = Some(mb * 1_000_000);
    assert!(!n.run().unwrap().notes.iter().any(|note| note.contains("max_memory")));
    let packed = format!("{frame}.fz");
    one_tile(&n.path(frame), &n.path(&packed));
    let summary = n.run().unwrap();
    let row = n.row(&packed);
    assert_eq!(row.status, "failed", "{}", row.reason);
    for word in ["max_memory", &format!("{mb} MB"), "1400x1100 px", "MB are needed", "clip_radius_px"] {
        assert!(row.reason.contains(word), "\"{word}\" is not in: {}", row.reason);
    }
    assert!(summary.notes.iter().any(|note| note.contains("1 of 12 light frames")), "{:?}", summary.notes);
    let measured = |n: &Night| n.rows().iter().filter(|r| r.status == "ok").count();
    assert_eq!(measured(&n) + 1, measured(&whole));
    // and with more memory it is measured
    n.options.max_memory_bytes = None;
    n.run().unwrap();
    assert_eq!(measured(&n), measured(&whole));
}

/// Makes a frame as large as said, with its header.
fn large(path: &Path, (nx, ny): (usize, usize)) {
    set_card(path, "NAXIS1", Some(&nx.to_string()));
    set_card(path, "NAXIS2", Some(&ny.to_string()));
    let start = pixels_begin(&std::fs::read(path).unwrap());
    cut(path, (start + (nx * ny * 2).div_ceil(2_880) * 2_880) as u64);
}

/// The first byte after the first header.
fn pixels_begin(bytes: &[u8]) -> usize {
    let end = (0..).find(|k| bytes[k * 80..].starts_with(b"END ")).unwrap() * 80;
    (end + 80).div_ceil(2_880) * 2_880
}

/// Packs a plain frame of 16-bit counts as one tile of GZIP_1 and takes the plain one away.
fn one_tile(plain: &Path, packed: &Path) {
    use std::io::Write as _;
    let bytes = std::fs::read(plain).unwrap();
    let start = pixels_begin(&bytes);
    let cards: Vec<String> = bytes[..start].chunks(80).map(|card| String::from_utf8_lossy(card).into_owned()).collect();
    let value = |key: &str| -> usize {
        let card = cards.iter().find(|card| card.starts_with(&format!("{key:<8}="))).unwrap();
        card[10..30].trim().parse().unwrap()
    };
    let (nx, ny) = (value("NAXIS1"), value("NAXIS2"));
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(&bytes[start..start + nx * ny * 2]).unwrap();
    let heap = encoder.finish().unwrap();
    let card = |key: &str, value: &str| format!("{:<80}", format!("{key:<8}= {value:>20}"));
    let padded = |mut header: String| {
        header += &format!("{:<80}", "END");
        while !header.len().is_multiple_of(2_880) {
            header.push(' ');
        }
        header
    };
    let primary = [card("SIMPLE", "T"), card("BITPIX", "8"), card("NAXIS", "0"), card("EXTEND", "T")].concat();
    let text = |key: &str, value: &str| format!("{:<80}", format!("{key:<8}= '{value:<8}'"));
    let number = |key: &str, n: usize| card(key, &n.to_string());
    let mut table = [
        text("XTENSION", "BINTABLE"),
        number("BITPIX", 8),
        number("NAXIS", 2),
        number("NAXIS1", 8),
        number("NAXIS2", 1),
        number("PCOUNT", heap.len()),
        number("GCOUNT", 1),
        number("TFIELDS", 1),
        text("TTYPE1", "COMPRESSED_DATA"),
        text("TFORM1", &format!("1PB({})", heap.len())),
        card("ZIMAGE", "T"),
        text("ZCMPTYPE", "GZIP_1"),
        number("ZBITPIX", 16),
        number("ZNAXIS", 2),
        number("ZNAXIS1", nx),
        number("ZNAXIS2", ny),
        number("ZTILE1", nx),
        number("ZTILE2", ny),
    ]
    .concat();
    let own = ["SIMPLE", "BITPIX", "NAXIS", "NAXIS1", "NAXIS2", "EXTEND", "END", "CHECKSUM", "DATASUM"];
    for card in cards.iter().filter(|card| !own.contains(&card[..8].trim_end())) {
        table += card;
    }
    let mut out = [padded(primary), padded(table)].concat().into_bytes();
    out.extend((heap.len() as u32).to_be_bytes());
    out.extend(0_u32.to_be_bytes());
    out.extend(&heap);
    out.resize(out.len().div_ceil(2_880) * 2_880, 0);
    std::fs::write(packed, out).unwrap();
    std::fs::remove_file(plain).unwrap();
}

#[test]
fn names_of_any_bytes_are_measured_and_lead_back_to_their_files() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let n = night();
    let mut named = Vec::new();
    for (prefix, frame) in [("flat", ROLES[0].1), ("field", ROLES[1].1), ("target", TARGETS[0]), ("target", TARGETS[2])]
    {
        let k = named.len() as u8;
        let mut name = [prefix.as_bytes(), b"_\xff\t100%41\n\x1b[2J\xe2\x80\xae_"].concat();
        name.extend([b'0' + k]);
        name.extend(b".fits");
        let name = OsStr::from_bytes(&name).to_owned();
        std::fs::rename(n.path(frame), n.path(".").join(&name)).unwrap();
        named.push(path_text(Path::new(&name)));
    }
    let sub = n.path(".").join(OsStr::from_bytes(b"sub\xfe\t"));
    std::fs::create_dir(&sub).unwrap();
    std::fs::rename(n.path(TARGETS[4]), sub.join(TARGETS[4])).unwrap();
    n.satphot(&["run"]).expect(0, &[]);
    let rows = n.rows();
    assert_eq!(rows.len(), TARGETS.len());
    for name in &named[2..] {
        let row = rows.iter().find(|r| r.frame == *name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(row.status, "ok", "{}", row.reason);
    }
    assert!(n.text("manifest.json").contains(&named[0]));
    let output = n.satphot(&["verify", "--inputs", "satphot-out/tiny"]).expect(0, &[]);
    assert!(output.out.contains("all as recorded"), "{}", output.out);
    assert!(!n.text("report.html").contains('\u{1b}'));
    // a change of such a file is found
    let path = std::fs::read_dir(n.path(".")).unwrap().map(|e| e.unwrap().path());
    let path = path.into_iter().find(|p| path_text(Path::new(p.file_name().unwrap())) == named[2]).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[9_000] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    n.satphot(&["verify", "--inputs", "satphot-out/tiny"]).expect(6, &["changed since the run"]);

    // the shards of a plan find the files again
    n.satphot(&["plan", "-q", "-o", "plan.json", "--frames-per-shard", "3"]).expect(0, &[]);
    n.satphot(&["zeropoint", "-q", "--plan", "plan.json", "-o", "night/zeropoint.toml"]).expect(0, &[]);
    for shard in ["0", "1"] {
        let out = format!("night/shards/{shard}.ecsv");
        let args = ["measure", "-q", "--plan", "plan.json", "--shard", shard, "--zeropoint", "night/zeropoint.toml"];
        n.satphot(&[&args[..], &["--out", &out]].concat()).expect(0, &[]);
    }
    let tables = ["night/shards/0.ecsv", "night/shards/1.ecsv", "-o", "night/photometry.ecsv"];
    n.satphot(&[&["merge"][..], &tables].concat()).expect(0, &[]);
    let (merged, _) = satphot::tables::read_photometry(&n.path("night/photometry.ecsv")).unwrap();
    let names = |rows: &[PhotometryRow]| rows.iter().map(|r| r.frame.clone()).collect::<Vec<_>>();
    assert_eq!(names(&merged), names(&rows));
}

#[test]
fn damaged_rows_of_elements_and_catalogue_are_reported_and_skipped() {
    let whole = night();
    let tle = std::fs::read_to_string(whole.path("iss-2025-june.tle")).unwrap();
    let other = "OTHER\n1 99999U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9990\n2 99999  51.6400\n";
    let hostile = format!("{}\n{other}\u{1b}[2J\n{tle}", "X".repeat(1 << 20));
    let catalogue = std::fs::read_to_string(whole.path("catalogue.csv")).unwrap();
    let columns = catalogue.lines().next().unwrap().split(',').count();
    let bad = [vec!["nan"; columns].join(","), vec!["1e999"; columns].join(","), "x".repeat(1 << 18), ",".repeat(3)];
    for (name, text, word) in [
        ("iss-2025-june.tle", hostile, "99999"),
        ("catalogue.csv", format!("{catalogue}{}\n", bad.join("\n")), "rows skipped"),
    ] {
        // with the number of the satellite a damaged set is known to be another's
        let n = night().file(name, text).set("orbit.norad_cat_id=25544");
        let summary = n.run().unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(summary.notes.iter().any(|note| note.contains(word)), "{name}: {:?}", summary.notes);
        assert_eq!(
            n.rows().iter().map(|r| r.v_mag).collect::<Vec<_>>(),
            undamaged().iter().map(|r| r.v_mag).collect::<Vec<_>>()
        );
    }
}

#[test]
fn folders_that_lead_nowhere_or_back_cost_nothing_or_a_row() {
    let n = allowing(night());
    std::os::unix::fs::symlink(".", n.path("again")).unwrap();
    std::fs::create_dir(n.path("folder.fits")).unwrap();
    std::os::unix::fs::symlink("loop_b", n.path("loop_a")).unwrap();
    std::os::unix::fs::symlink("loop_a", n.path("loop_b")).unwrap();
    n.run().unwrap();
    assert_eq!(n.rows().len(), TARGETS.len());
}

/// Frames so large that the level of a flat is taken of every third row, Rice-compressed as cameras' programs pack them.
#[test]
fn a_packed_flat_damaged_where_its_level_did_not_look_leaves_the_master_and_the_night_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "frame.nx_px=2700",
        "frame.ny_px=2600",
        "pointings.n=1",
        "target.n=1",
        "flats.n=4",
        "compress=true",
        "name=tiny",
    ];
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    simulate(&Scenario::demo_night(&sets).unwrap(), folder.path(), &Silent).unwrap();
    let config = Config::load(&folder.path().join("pipeline.toml"), &[]).unwrap();
    let damaged = folder.path().join("flat_002.fits.fz");
    assert!(damaged.is_file());
    let flats = || -> Vec<_> {
        let names = (0..4).map(|k| folder.path().join(format!("flat_00{k}.fits.fz")));
        names.map(|path| classify(&path, &config, &[]).unwrap()).collect()
    };
    let detector = Detector::from_config(&config.detector).unwrap();
    let master = |clip| MasterFlat::make(&flats(), &detector, &config.flat, clip, BAND_BYTES).unwrap();
    let whole = master(None);
    assert!(whole.members.iter().all(|m| m.used));
    // the tile of a row that is not among every third from the second
    let bytes = std::fs::read(&damaged).unwrap();
    let row = damage_tile(&damaged, 1_200);
    let without = master(None);
    let member = &without.members[2];
    assert!(!member.used && member.reason.contains("flat_002.fits.fz"), "row {row}: {member:?}");
    assert_eq!(without.members.iter().filter(|m| m.used).count(), 3);
    let pairs = without.response.iter().zip(&whole.response).filter(|(a, b)| a.is_finite() && b.is_finite());
    let off: Vec<f64> = pairs.map(|(a, b)| f64::from((a - b).abs())).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    assert!(off.len() > 6_000_000 && mean < 0.01, "the others make the master: {mean} over {} pixels", off.len());
    let jobs = Options { jobs: 2, no_figures: true, ..Options::default() };
    let summary = run(&config, &jobs, &Silent).unwrap();
    assert_eq!(summary.counts.flats, 4, "{}", summary.brief());
    let (rows, _) = satphot::tables::read_photometry(&summary.folder.join("photometry.ecsv")).unwrap();
    let row = rows.iter().find(|r| r.frame == "flat_002.fits.fz").unwrap();
    assert!(row.reason.contains("flat: "), "{}", row.reason);
    std::fs::write(&damaged, bytes).unwrap();
}

/// Overwrites the compressed bytes of the tile of one row, and says which.
fn damage_tile(path: &Path, row: usize) -> usize {
    let mut bytes = std::fs::read(path).unwrap();
    let text = |card: &[u8]| String::from_utf8_lossy(card).into_owned();
    // the second header: that of the binary table
    let table = (1..).find(|k| bytes[k * 2_880..].starts_with(b"XTENSION")).unwrap() * 2_880;
    let end = (0..).find(|k| bytes[table + k * 80..].starts_with(b"END ")).unwrap();
    let data = (table + (end + 1) * 80).div_ceil(2_880) * 2_880;
    let value = |key: &str| -> usize {
        let cards = (0..end).map(|k| text(&bytes[table + k * 80..table + (k + 1) * 80]));
        let card = cards.into_iter().find(|c| c.starts_with(&format!("{key:<8}="))).unwrap();
        card[10..30].trim().parse().unwrap()
    };
    let (width, rows, heap) = (value("NAXIS1"), value("NAXIS2"), value("NAXIS1") * value("NAXIS2"));
    assert!(row % 3 != 1 && row < rows);
    let descriptor = &bytes[data + row * width..data + row * width + 8];
    let number = |b: &[u8]| u32::from_be_bytes(b.try_into().unwrap()) as usize;
    let (length, offset) = (number(&descriptor[..4]), number(&descriptor[4..]));
    // a difference code of a block that needs more bits than follow: the stream ends too soon
    let descriptor_at = data + row * width;
    bytes[descriptor_at..descriptor_at + 4].copy_from_slice(&4_u32.to_be_bytes());
    let at = data + heap + offset;
    bytes[at..at + length.min(64)].fill(0xff);
    std::fs::write(path, bytes).unwrap();
    row
}

/// Three hundred random changes of the tables of shards: none is merged in silence.
#[test]
fn a_table_of_a_shard_that_was_changed_is_never_merged() {
    use rand::{Rng, SeedableRng};
    let n = night();
    n.satphot(&["plan", "-q", "-o", "plan.json", "--frames-per-shard", "3"]).expect(0, &[]);
    n.satphot(&["zeropoint", "-q", "--plan", "plan.json", "-o", "night/zeropoint.toml"]).expect(0, &[]);
    for shard in ["0", "1"] {
        let out = format!("night/shards/{shard}.ecsv");
        let args = ["measure", "-q", "--plan", "plan.json", "--shard", shard, "--zeropoint", "night/zeropoint.toml"];
        n.satphot(&[&args[..], &["--out", &out]].concat()).expect(0, &[]);
    }
    let plan = satphot::pipeline::shards::plan_file::Plan::read(&n.path("plan.json")).unwrap();
    let tables = [n.path("night/shards/0.ecsv"), n.path("night/shards/1.ecsv")];
    let merge = |tables: &[PathBuf]| satphot::pipeline::shards::merge::merge(&plan, tables, true);
    merge(&tables).unwrap();
    // a sum that lacks a shard carries a hash too
    n.satphot(&["merge", "-q", "night/shards/0.ecsv", "--allow-missing", "-o", "night/part.ecsv"]).expect(0, &[]);
    let part = n.path("night/part.ecsv");
    merge(std::slice::from_ref(&part)).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(24);
    for k in 0..300 {
        let table = [&tables[0], &tables[1], &part][k % 3];
        let good = std::fs::read(table).unwrap();
        let mut bad = good.clone();
        let at = rng.random_range(0..bad.len());
        match k % 4 {
            0 => bad[at] = bad[at].wrapping_add(rng.random_range(1..=255)),
            1 => drop(bad.remove(at)),
            2 => bad.insert(at, rng.random_range(b'0'..=b'9')),
            // a digit of a number: the table is as good as before
            _ => match bad.iter().skip(at).position(u8::is_ascii_digit) {
                Some(next) => bad[at + next] = b'0' + (bad[at + next] - b'0' + 1) % 10,
                None => bad.truncate(at),
            },
        }
        std::fs::write(table, &bad).unwrap();
        assert!(merge(std::slice::from_ref(table)).is_err(), "change {k} at byte {at} of {}", table.display());
        std::fs::write(table, good).unwrap();
    }
    // a line of the header that ends the meta block before the hash
    let good = std::fs::read(&part).unwrap();
    let begin = |line: &[u8]| good.windows(line.len()).position(|at| at == line).unwrap();
    for at in [begin(b"# - {colour_index"), begin(b"# - {missing_frames"), begin(b"# - {rows_sha256")].map(|at| at + 2)
    {
        let mut bad = good.clone();
        bad[at] = b'4';
        std::fs::write(&part, bad).unwrap();
        assert!(merge(std::slice::from_ref(&part)).is_err(), "byte {at}");
    }
    std::fs::write(&part, good).unwrap();
    // one flux in one cell, as the issue of such a table would have it
    let text = std::fs::read_to_string(&tables[0]).unwrap();
    let flux = merge(&tables[..1]).unwrap().rows.iter().find_map(|r| r.flux_e).unwrap();
    let edited = text.replace(&format!(",{flux},"), &format!(",{},", flux * 2.0));
    assert_ne!(edited, text);
    std::fs::write(&tables[0], edited).unwrap();
    n.satphot(&["merge", "night/shards/0.ecsv", "night/shards/1.ecsv"]).expect(6, &["0.ecsv", "rows_sha256"]);
    n.satphot(&["verify", "night/shards/0.ecsv", "night/shards/1.ecsv"]).expect(6, &["0.ecsv", "rows_sha256"]);
    n.satphot(&["verify", "night/shards/1.ecsv"]).expect(0, &[]);
}
