//! Thousands of mutated FITS files, read in child processes: no signal, no hang, no memory beyond the file's own size.
//!
//! `scripts/prove_damage.sh [COUNT] [SEED]` runs more of them. Each mutation has a number from which it can be made again:
//! `MUTATION=17 cargo test --test frames -- --ignored one_batch --nocapture`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::frames_support;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use frames_support::*;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satphot::fits::{Header, wrong_checksum};
use satphot::frames::classify;

/// Address space of a child \[kB\]: a mutated file of 12 kB must not ask for more. Threads and the program take 300 MB.
const MEMORY_KB: u64 = 2_000_000;
/// A batch that takes longer hangs; it takes a few seconds.
const TIMEOUT: Duration = Duration::from_secs(300);

/// Files to begin with: every BITPIX and compression, checksums in all, and a raw frame.
fn originals() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/tiles"));
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    let mut all: Vec<(String, Vec<u8>)> = paths
        .iter()
        .map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(p).unwrap()))
        .collect();
    let raw = [card("BZERO", 32768), card("BSCALE", 1)];
    let more: Vec<String> = light().into_iter().chain(raw).collect();
    all.push(("raw_u16.fits".into(), fits(16, 40, 30, &more, &[0x81; 2400])));
    all
}

const KINDS: [&str; 10] = [
    "header bytes flipped",
    "data bytes flipped",
    "cut at a block",
    "cut anywhere",
    "a value that lies",
    "a card lost, doubled or moved",
    "not ASCII",
    "a descriptor of a tile",
    "a block lost, doubled or zeroed",
    "several of these",
];

/// Values no honest header has under most keywords.
const LIES: [&str; 34] = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "7",
    "8",
    "16",
    "-16",
    "32",
    "-32",
    "64",
    "-64",
    "999",
    "1000",
    "65536",
    "777777701",
    "2147483647",
    "-2147483648",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "99999999999999999999",
    "1E3",
    "1E400",
    "NaN",
    "'16'",
    "T",
    "''",
    "'RICE_1  '",
    "'GZIP_1  '",
    "'PLIO_1  '",
    "'HCOMPRESS_1'",
    "'1PI(9)  '",
];

const LIARS: [&str; 32] = [
    "NAXIS", "BITPIX", "NAXIS1", "NAXIS2", "PCOUNT", "GCOUNT", "TFIELDS", "TFORM1", "TFORM2", "TFORM3", "ZTILE1",
    "ZTILE2", "ZNAXIS", "ZNAXIS1", "ZNAXIS2", "ZBITPIX", "ZCMPTYPE", "ZVAL1", "ZVAL2", "ZNAME1", "ZQUANTIZ",
    "ZDITHER0", "THEAP", "BSCALE", "BZERO", "BLANK", "ZBLANK", "TTYPE1", "TTYPE2", "XTENSION", "ZIMAGE", "SIMPLE",
];

/// Bytes of the headers, END blocks included, and where the data of the last HDU begin.
fn headers(bytes: &[u8]) -> (Vec<usize>, usize) {
    let mut cards = Vec::new();
    let mut inside = false;
    let mut data = 0;
    for (k, card) in bytes.chunks_exact(80).enumerate() {
        inside |= card.starts_with(b"SIMPLE  =") || card.starts_with(b"XTENSION=");
        if inside {
            cards.push(k * 80);
            if card.starts_with(b"END     ") {
                inside = false;
                data = ((k + 1) * 80).div_ceil(2880) * 2880;
            }
        }
    }
    (cards, data.min(bytes.len()))
}

/// Damages a file; `kind` is an index of [`KINDS`].
fn mutate(bytes: &mut Vec<u8>, kind: usize, rng: &mut ChaCha8Rng) {
    let (cards, data) = headers(bytes);
    if cards.is_empty() || bytes.len() < 3000 {
        return;
    }
    let any_card = |rng: &mut ChaCha8Rng| *cards.choose(rng).unwrap();
    match KINDS[kind] {
        "header bytes flipped" => {
            for _ in 0..rng.random_range(1..5) {
                let at = any_card(rng) + rng.random_range(0..40);
                bytes[at] = match rng.random_range(0..3) {
                    0 => *b"0123456789-+.ETF' =/".choose(rng).unwrap(),
                    1 => rng.random_range(0x20..0x7f),
                    _ => bytes[at] ^ 1 << rng.random_range(0..8),
                };
            }
        }
        "data bytes flipped" => {
            for _ in 0..rng.random_range(1..9) {
                let at = rng.random_range(data.min(bytes.len() - 1)..bytes.len());
                bytes[at] = if rng.random() { rng.random() } else { *[0, 0xff, 0x7f, 0x80].choose(rng).unwrap() };
            }
        }
        "cut at a block" => bytes.truncate(rng.random_range(0..=bytes.len() / 2880) * 2880),
        "cut anywhere" => bytes.truncate(rng.random_range(0..bytes.len())),
        "a value that lies" => {
            // a keyword of the structure that is there
            for _ in 0..20 {
                let key = format!("{:<8}=", LIARS.choose(rng).unwrap());
                let there: Vec<usize> =
                    cards.iter().copied().filter(|at| bytes[*at..].starts_with(key.as_bytes())).collect();
                let Some(at) = there.choose(rng) else { continue };
                let lie = format!("{:>20}{:50}", LIES.choose(rng).unwrap(), "");
                bytes[at + 10..at + 80].copy_from_slice(lie.as_bytes());
                break;
            }
        }
        "a card lost, doubled or moved" => {
            let (from, to) = (any_card(rng), any_card(rng));
            let card = bytes[from..from + 80].to_vec();
            match rng.random_range(0..3) {
                0 => bytes[from..from + 80].fill(b' '),
                1 => bytes[to..to + 80].copy_from_slice(&card),
                _ => bytes.copy_within(to..to + 80, from),
            }
        }
        "not ASCII" => {
            for _ in 0..rng.random_range(1..20) {
                let at = any_card(rng) + rng.random_range(0..80);
                bytes[at] = if rng.random() { rng.random_range(0x80..=0xff) } else { rng.random_range(0..0x20) };
            }
        }
        "a descriptor of a tile" => {
            for _ in 0..rng.random_range(1..4) {
                let at = data + 4 * rng.random_range(0..46usize);
                let value: u32 = match rng.random_range(0..4) {
                    0 => rng.random(),
                    1 => rng.random_range(0..70),
                    2 => *[0, 1, u32::MAX, 1 << 31, (1 << 31) - 1].choose(rng).unwrap(),
                    _ => rng.random_range(0..9000),
                };
                if let Some(slot) = bytes.get_mut(at..at + 4) {
                    slot.copy_from_slice(&value.to_be_bytes());
                }
            }
        }
        "a block lost, doubled or zeroed" => {
            let at = rng.random_range(0..bytes.len() / 2880) * 2880;
            let block = at..at + 2880;
            match rng.random_range(0..3) {
                0 => drop(bytes.drain(block)),
                1 => bytes[block].fill(0),
                _ => {
                    let copy = bytes[block.clone()].to_vec();
                    bytes.splice(block.start..block.start, copy);
                }
            }
        }
        _ => {
            for _ in 0..rng.random_range(2..5) {
                let kind = rng.random_range(0..KINDS.len() - 1);
                mutate(bytes, kind, rng);
            }
        }
    }
}

/// Values of a file in bits, or why it is refused.
fn outcome(path: &Path) -> Result<Vec<u32>, String> {
    let header = Header::read(path).map_err(|e| e.to_string())?;
    let frame = read(&anything(path, header), unit_gain(), None, None).map_err(|e| e.to_string())?;
    Ok(frame.pixels.iter().map(|v| v.to_bits()).collect())
}

/// Reads mutations `from` to `to` of `seed` and prints what came of each kind.
fn batch(seed: u64, from: u64, to: u64) {
    let originals = originals();
    let dir = tempfile::tempdir().unwrap();
    let right: Vec<Vec<u32>> =
        originals.iter().map(|(name, bytes)| outcome(&put(dir.path(), name, bytes)).unwrap()).collect();
    let path = dir.path().join("mutated.fits");
    let config = config(&[]);
    let mut counts: BTreeMap<(usize, &str), u64> = BTreeMap::new();
    for number in from..to {
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(number));
        let kind = (number % KINDS.len() as u64) as usize;
        let original = rng.random_range(0..originals.len());
        let mut bytes = originals[original].1.clone();
        mutate(&mut bytes, kind, &mut rng);
        std::fs::write(&path, &bytes).unwrap();
        if std::env::var_os("MUTATION").is_some() {
            println!("{number}: {} of {}", KINDS[kind], originals[original].0);
            std::fs::write(std::env::temp_dir().join(format!("mutation_{number}.fits")), &bytes).unwrap();
        }
        let got = outcome(&path);
        let _ = classify(&path, &config, &[]);
        let what = match got {
            Ok(values) if values == right[original] => "right",
            Ok(_) => {
                let header = Header::read(&path).unwrap();
                match wrong_checksum(&path, &header).unwrap() {
                    Some(_) => "other, detected",
                    None if header.card("DATASUM").is_none() && header.card("CHECKSUM").is_none() => "other, no sums",
                    None => "other, silent",
                }
            }
            Err(message) => {
                assert!(!message.contains("panicked"), "mutation {number}: {message}");
                assert!(message.contains("mutated.fits"), "mutation {number}: {message}");
                "refused"
            }
        };
        *counts.entry((kind, what)).or_default() += 1;
    }
    for ((kind, what), n) in counts {
        println!("COUNT {kind} {what}: {n}");
    }
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or("0 kB");
    println!("PEAK {}", peak.trim().trim_end_matches(" kB"));
}

fn setting(name: &str, absent: u64) -> u64 {
    std::env::var(name).ok().map_or(absent, |v| v.parse().expect("a number"))
}

/// The child: not a test of its own.
#[test]
#[ignore = "run by the others in a process of its own"]
fn one_batch() {
    let from = setting("MUTATION", setting("FROM", 0));
    batch(
        setting("SEED", 1),
        from,
        from + if std::env::var_os("MUTATION").is_some() { 1 } else { setting("BATCH", 0) },
    );
}

/// Runs a batch in a child with little memory; its output, or how it died.
fn child(seed: u64, from: u64, count: u64) -> Result<String, String> {
    let limited = format!(
        "ulimit -v {MEMORY_KB}; exec \"$0\" --ignored --exact mutations::one_batch --nocapture --test-threads=1"
    );
    let mut child = Command::new("sh")
        .args(["-c", &limited])
        .arg(std::env::current_exe().unwrap())
        .env("SEED", seed.to_string())
        .env("FROM", from.to_string())
        .env("BATCH", count.to_string())
        .env("RAYON_NUM_THREADS", "2")
        .env_remove("MUTATION")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > TIMEOUT {
            child.kill().unwrap();
            return Err("does not end".into());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if output.status.success() && text.contains("PEAK ") {
        return Ok(text);
    }
    Err(format!("{}\n{text}\n{}", output.status, String::from_utf8_lossy(&output.stderr)))
}

/// The smallest part of a batch that still dies.
fn culprit(seed: u64, mut from: u64, mut count: u64) -> u64 {
    while count > 1 {
        let half = count / 2;
        if child(seed, from, half).is_err() {
            count = half;
        } else {
            (from, count) = (from + half, count - half);
        }
    }
    from
}

fn prove(seed: u64, total: u64, per_batch: u64) {
    let mut counts: BTreeMap<(usize, String), u64> = BTreeMap::new();
    let (mut peak_kb, mut dead) = (0u64, Vec::new());
    for from in (0..total).step_by(per_batch as usize) {
        let count = per_batch.min(total - from);
        let text = match child(seed, from, count) {
            Ok(text) => text,
            Err(how) => {
                let number = culprit(seed, from, count);
                println!("MUTATION={number} SEED={seed}: {how}");
                dead.push(number);
                continue;
            }
        };
        for line in text.lines() {
            // the first line of the harness may stand before it
            if let Some((_, count)) = line.split_once("COUNT ") {
                let (key, n) = count.split_once(": ").unwrap();
                let (kind, what) = key.split_once(' ').unwrap();
                *counts.entry((kind.parse().unwrap(), what.to_owned())).or_default() += n.parse::<u64>().unwrap();
            } else if let Some((_, kb)) = line.split_once("PEAK ") {
                peak_kb = peak_kb.max(kb.trim().parse().unwrap());
            }
        }
    }
    let of = |kind: usize, what: &str| counts.get(&(kind, what.to_owned())).copied().unwrap_or(0);
    println!(
        "| damage | files | right all the same | other values, a checksum detects | other values, no checksum in the file | other values, checksum right | refused |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (k, kind) in KINDS.iter().enumerate() {
        let n = ["right", "other, detected", "other, no sums", "other, silent", "refused"].map(|w| of(k, w));
        println!("| {kind} | {} | {} | {} | {} | {} | {} |", n.iter().sum::<u64>(), n[0], n[1], n[2], n[3], n[4]);
    }
    let all: u64 = counts.values().sum();
    println!("{all} mutations, {} processes died, peak memory {} MB", dead.len(), peak_kb / 1000);
    assert!(dead.is_empty(), "died: {dead:?}");
    assert_eq!(all, total);
    let refused: u64 = (0..KINDS.len()).map(|k| of(k, "refused")).sum();
    assert!(refused > total / 5 && refused < total * 9 / 10, "{refused} of {total}: the mutations test nothing");
}

#[test]
fn a_thousand_mutated_files_kill_no_process() {
    prove(setting("SEED", 1), 1_000, 500);
}

#[test]
#[ignore = "minutes: scripts/prove_damage.sh"]
fn many_mutated_files_kill_no_process() {
    prove(setting("SEED", 1), setting("COUNT", 20_000), 1_000);
}
