//! Shards of a prediction: which of how many a table holds, and merging the tables of shards.
//!
//! A table says `shard: 2/8` in its meta block, a sum of some `1,3/8`, the whole `1/1`: the sum of all is the table of the
//! whole, byte for byte, in whatever order, and a shard given twice counts once.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use satphot::Error;
use satphot::tables::{Meta, MetaValue, check_rows_hash, names_rows_hash, read_meta};

/// The shards a table holds, from 1, and of how many.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shards {
    have: BTreeSet<usize>,
    of: usize,
}

impl Shards {
    fn parse(text: &str) -> Option<Self> {
        let (have, of) = text.split_once('/')?;
        let have: BTreeSet<usize> = have.split(',').map(|i| i.trim().parse().ok()).collect::<Option<_>>()?;
        let of = of.trim().parse().ok()?;
        have.iter().all(|i| (1..=of).contains(i)).then_some(Self { have, of })
    }

    /// The `number`-th of `of`, from 1.
    pub fn one(number: usize, of: usize) -> Self {
        Self { have: BTreeSet::from([number]), of }
    }

    /// States the shards in the meta block of their table, which carries the hash of its rows unless it is the whole.
    pub fn state_in(&self, meta: &mut Meta) {
        if self.missing().is_empty() {
            return meta.set("shard", "1/1");
        }
        let have: Vec<String> = self.have.iter().map(usize::to_string).collect();
        meta.set("shard", format!("{}/{}", have.join(","), self.of));
        meta.with_rows_hash();
    }

    fn missing(&self) -> Vec<String> {
        (1..=self.of).filter(|i| !self.have.contains(i)).map(|i| i.to_string()).collect()
    }

    /// The error of a sum that is written but lacks shards (exit code 3).
    pub fn lacking(&self) -> Option<Error> {
        let missing = self.missing();
        let problem = format!("shards {} of {} are missing in this sum", missing.join(", "), self.of);
        (!missing.is_empty()).then_some(Error::PoorNight { problem })
    }
}

/// `i/N` with 1 ≤ i ≤ N.
pub fn shard(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match parts {
        Some((i, n)) if i >= 1 && i <= n => Ok((i, n)),
        _ => Err("not a shard such as 2/8: its number from 1, and how many there are".into()),
    }
}

/// Which of the tables to add, without those whose shards are there already; the shards of their sum and its meta block.
///
/// # Errors
/// [`Error::Mismatch`] for tables of different predictions, or sums that share some of their shards; [`Error::Table`].
pub fn together(paths: &[PathBuf]) -> anyhow::Result<(Vec<PathBuf>, Shards, Meta)> {
    let mut sum: Option<(Vec<PathBuf>, Shards, Meta)> = None;
    for path in paths {
        let mut meta = read_meta(path)?;
        let shards = match meta.get("shard") {
            Some(MetaValue::Text(text)) => Shards::parse(text),
            _ => None,
        };
        let problem = || "shard is missing in its meta block; is it a table of `satphot predict`?".to_string();
        let shards = shards.ok_or_else(|| Error::Table { path: path.clone(), line: None, problem: problem() })?;
        if !shards.missing().is_empty() || names_rows_hash(path)? {
            check_rows_hash(path)?;
        }
        meta.without_rows_hash();
        meta.set("shard", "");
        let Some((added, all, first)) = &mut sum else {
            sum = Some((vec![path.clone()], shards, meta));
            continue;
        };
        if *first != meta || all.of != shards.of {
            return Err(differ(&added[0], path, "are not shards of one prediction").into());
        }
        match shards.have.intersection(&all.have).count() {
            0 => {
                all.have.extend(&shards.have);
                added.push(path.clone());
            }
            n if n == shards.have.len() => {} // there already
            _ => return Err(differ(&added[0], path, "share some of their shards; add the shards themselves").into()),
        }
    }
    let (added, shards, mut meta) = sum.ok_or_else(|| super::bad("--merge", "no table is named".into()))?;
    shards.state_in(&mut meta);
    Ok((added, shards, meta))
}

fn differ(a: &Path, b: &Path, how: &str) -> Error {
    Error::Mismatch { problem: format!("{} and {} {how}", a.display(), b.display()) }
}
