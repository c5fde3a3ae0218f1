//! Curves of other programs next to ours, from a Python of the user's that has them.
//!
//! The script is part of the program; what it cannot import is reported and excluded. Truth and errors are as in our
//! sweeps.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use satphot::Error;
use satphot::accuracy::{CpuTime, Errors, Method, Series, Sweep, SweepPoint};

use super::super::tell;

const SCRIPT: &str = include_str!("../../../scripts/accuracy_peers.py");
/// Methods the script knows.
const METHODS: [&str; 3] = ["earth-reflected", "apertures", "background-mesh"];
/// Where interpreters are named for good.
const VARIABLE: &str = "SATPHOT_PYTHON";

/// Adds the peers' series to the sweeps they have one for.
pub fn add(sweeps: &mut [(Method, Sweep)], given: &[PathBuf], full: bool, quiet: bool) -> anyhow::Result<()> {
    let mut pythons = given.to_vec();
    if pythons.is_empty() {
        let named = std::env::var_os(VARIABLE).unwrap_or_default();
        pythons = std::env::split_paths(&named).filter(|path| !path.as_os_str().is_empty()).collect();
    }
    let mut known = sweeps.iter_mut().filter(|(m, _)| METHODS.contains(&m.name)).peekable();
    if pythons.is_empty() && known.peek().is_some() && !quiet {
        tell(
            "note: no curves of lumos-sat, sep or photutils: name a Python that has them with --python or SATPHOT_PYTHON",
        );
    }
    for (method, sweep) in known {
        for python in &pythons {
            match curves(python, method.name, full) {
                Ok((series, notes)) => {
                    sweep.series.extend(series);
                    notes.iter().filter(|_| !quiet).for_each(|n| tell(&format!("note: {}: {n}", python.display())));
                }
                // named on the command line it must work
                Err(problem) if !given.is_empty() => {
                    return Err(Error::Argument { name: "--python".into(), problem }.into());
                }
                Err(problem) => tell(&format!("note: {VARIABLE}: {problem}")),
            }
        }
    }
    Ok(())
}

/// What one interpreter measures of one method, and what it could not.
fn curves(python: &Path, method: &str, full: bool) -> Result<(Vec<Series>, Vec<String>), String> {
    let failed = |e: std::io::Error| format!("{} cannot be run ({e})", python.display());
    let own = std::env::current_exe().map_err(failed)?;
    let mut child = Command::new(python)
        .arg("-")
        .arg(own)
        .args([method, if full { "full" } else { "quick" }])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    if let Some(mut stdin) = child.stdin.take() {
        stdin.write_all(SCRIPT.as_bytes()).map_err(failed)?;
    }
    let out = child.wait_with_output().map_err(failed)?;
    let messages: Vec<String> = String::from_utf8_lossy(&out.stderr).lines().map(str::to_owned).collect();
    if !out.status.success() {
        let last = messages.last().cloned().unwrap_or_default();
        return Err(format!("{}: {last}", python.display()));
    }
    let mut series: Vec<Series> = Vec::new();
    for line in String::from_utf8_lossy(&out.stdout).lines() {
        let Some((label, point)) = point(line) else {
            return Err(format!("{}: not a line of results: {line}", python.display()));
        };
        match series.last_mut().filter(|s| s.label == label) {
            Some(last) => last.points.push(point),
            None => series.push(Series { label, points: vec![point] }),
        }
    }
    Ok((series, messages.into_iter().filter(|t| t.contains("No module")).collect()))
}

/// method,case,setting,n,median,p95,worst,cpu_us
fn point(line: &str) -> Option<(String, SweepPoint)> {
    let cells: Vec<&str> = line.split(',').collect();
    let [_, label, setting, n, median, p95, worst, cpu_us] = cells.as_slice() else { return None };
    let errors = Errors {
        median: median.parse().ok()?,
        p95: p95.parse().ok()?,
        worst: worst.parse().ok()?,
        n: n.parse().ok()?,
        bias: None,
        scatter: None,
        coverage_frac: None,
    };
    let cpu_us = CpuTime::once(cpu_us.parse().ok()?);
    let setting = (*setting).to_string();
    Some(((*label).to_string(), SweepPoint { setting, errors, cpu_us, memory_kb: None, is_default: false }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_results_is_read_and_anything_else_is_not() {
        let (label, p) = point("apertures,sep: circle,5,200,1e-3,2e-3,inf,4.5").unwrap();
        assert_eq!(
            (label.as_str(), p.setting.as_str(), p.errors.n, p.cpu_us.median_us),
            ("sep: circle", "5", 200, 4.5)
        );
        assert_eq!(p.errors.worst, f64::INFINITY);
        assert!(point("Traceback (most recent call last):").is_none());
        assert!(point("a,b,c,1,x,2,3,4").is_none());
    }
}
