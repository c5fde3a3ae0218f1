//! End to end: the magnitude of a satellite from raw frames, and the zeropoint, by every key of the configuration that
//! moves them.
//!
//! Simulated nights, every second one crowded with star trails, are reduced once with each setting. Errors in magnitudes
//! against what was simulated; the time is that of the whole reduction (flats, stars, targets, tables; no figures) for
//! each target or star frame. All settings see the same nights one after the other, and a time is the default's times the
//! median of the ratios to the default on the same night, so that a slow minute of the machine is in both.

mod scenes;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint};
use super::timing::CpuTime;
use crate::base::error::{Error, Result};
use scenes::{Measured, Night, Of, Setting};

/// A key or two that belong together, the default's text, and the other settings.
struct Knob {
    label: &'static str,
    default: &'static str,
    others: &'static [Setting],
    /// Whether the zeropoint depends on it, and whether the target frames do.
    of: (bool, bool),
}

const fn set(text: &'static str, sets: &'static [&'static str]) -> Setting {
    Setting { text, sets, flats: None }
}

const fn flats(text: &'static str, n: usize) -> Setting {
    Setting { text, sets: &[], flats: Some(n) }
}

/// Every key is at its default but that of the setting.
const DEFAULT: Setting = set("default", &[]);

const KNOBS: &[Knob] = &[
    Knob {
        label: "photometry.aper_r_fwhm",
        default: "2",
        others: &[
            set("1", &["photometry.aper_r_fwhm=1.0"]),
            set("1.5", &["photometry.aper_r_fwhm=1.5"]),
            set("3", &["photometry.aper_r_fwhm=3.0", "photometry.sky_in_fwhm=4.0", "photometry.sky_out_fwhm=6.0"]),
        ],
        of: (true, true),
    },
    Knob {
        label: "photometry.sky_in_fwhm to sky_out_fwhm",
        default: "3 to 5",
        others: &[
            set("2.2 to 3", &["photometry.sky_in_fwhm=2.2", "photometry.sky_out_fwhm=3.0"]),
            set("4 to 8", &["photometry.sky_in_fwhm=4.0", "photometry.sky_out_fwhm=8.0"]),
        ],
        of: (true, true),
    },
    Knob {
        label: "photometry.aper_correction (growth curve)",
        default: "true",
        others: &[set("false", &["photometry.aper_correction=false"])],
        of: (true, true),
    },
    Knob {
        label: "photometry.mesh_px",
        default: "64",
        others: &[
            set("16", &["photometry.mesh_px=16"]),
            set("32", &["photometry.mesh_px=32"]),
            set("128", &["photometry.mesh_px=128"]),
        ],
        of: (true, true),
    },
    Knob {
        label: "photometry.clip_sigma",
        default: "3",
        others: &[set("2", &["photometry.clip_sigma=2.0"]), set("5", &["photometry.clip_sigma=5.0"])],
        of: (true, true),
    },
    Knob {
        label: "photometry.detect_sigma",
        default: "5",
        others: &[set("3", &["photometry.detect_sigma=3.0"]), set("10", &["photometry.detect_sigma=10.0"])],
        of: (true, false),
    },
    Knob {
        label: "target.margin_fwhm",
        default: "1.5",
        others: &[
            set("0.5", &["target.margin_fwhm=0.5"]),
            set("1", &["target.margin_fwhm=1.0"]),
            set("2.5", &["target.margin_fwhm=2.5"]),
        ],
        of: (false, true),
    },
    Knob {
        label: "target.shape",
        default: "auto",
        others: &[set("circle", &["target.shape=circle"]), set("pill", &["target.shape=pill"])],
        of: (false, true),
    },
    Knob {
        label: "target.search_radius_arcsec",
        default: "120",
        others: &[set("60", &["target.search_radius_arcsec=60.0"]), set("240", &["target.search_radius_arcsec=240.0"])],
        of: (false, true),
    },
    Knob { label: "flats", default: "9", others: &[flats("none", 0), flats("3", 3), flats("5", 5)], of: (true, true) },
    Knob {
        label: "flat.noise_frac",
        default: "all flats",
        others: &[set("0.004", &["flat.noise_frac=0.004"])],
        of: (true, true),
    },
    Knob {
        label: "stars.combine",
        default: "median",
        others: &[set("none", &["stars.combine=none"])],
        of: (true, false),
    },
    Knob {
        label: "stars.solve, scale_search_frac",
        default: "auto",
        others: &[
            set("always, 0.2", &["stars.solve=always"]),
            set("always, 0.02", &["stars.solve=always", "stars.scale_search_frac=0.02"]),
        ],
        of: (true, false),
    },
    Knob {
        label: "stars.match_radius_arcsec",
        default: "5",
        others: &[set("2", &["stars.match_radius_arcsec=2.0"]), set("10", &["stars.match_radius_arcsec=10.0"])],
        of: (true, false),
    },
    Knob {
        label: "zeropoint.estimator",
        default: "robust",
        others: &[
            set("ols", &["zeropoint.estimator=ols"]),
            set("huber", &["zeropoint.estimator=huber"]),
            set("clip", &["zeropoint.estimator=clip"]),
        ],
        of: (true, false),
    },
    Knob {
        label: "model.tolerance",
        default: "1e-4",
        others: &[set("1e-2", &["model.tolerance=1e-2"]), set("1e-8", &["model.tolerance=1e-8"])],
        of: (false, true),
    },
];

/// What a setting did on all nights: errors with what was stated, and its time over the default's, night by night.
#[derive(Default)]
struct Tally {
    errors: Vec<(f64, f64)>,
    ratios: Vec<f64>,
}

impl Tally {
    fn add(&mut self, measured: &Measured, default_s: f64) {
        self.errors.extend(&measured.errors);
        self.ratios.push(measured.cpu_s / default_s);
    }

    fn point(&self, setting: &str, (frame_us, is_default): (f64, bool)) -> Option<SweepPoint> {
        let errors = Errors::with_stated(&self.errors)?;
        let cpu_us = CpuTime::of(&self.ratios)? * frame_us;
        Some(SweepPoint { setting: setting.into(), errors, cpu_us, memory_kb: None, is_default })
    }
}

/// All settings of some knobs over all nights.
fn series(stopwatch: &Stopwatch, of: Of, nights: usize) -> Result<Vec<Series>> {
    let knobs: Vec<&Knob> = KNOBS.iter().filter(|k| if of == Of::Zeropoint { k.of.0 } else { true }).collect();
    let settings: usize = knobs.iter().map(|k| k.others.len()).sum();
    stopwatch.progress.stage(of.name(), nights * (settings + 2));
    let mut default = Tally::default();
    let mut tallies: Vec<Vec<Tally>> =
        knobs.iter().map(|k| k.others.iter().map(|_| Tally::default()).collect()).collect();
    let mut default_frame_us = Vec::new();
    for k in 0..nights {
        let night = Night::simulated(stopwatch.seed(4000 + k as u64), k % 2 == 1, of)?;
        let reduced = |setting: &Setting| {
            let measured = night.reduced(setting, stopwatch);
            stopwatch.progress.tick();
            measured
        };
        // before all others and after them: how far apart the two are is the error of the default's own time
        let first = reduced(&DEFAULT)?;
        for (knob, of_knob) in knobs.iter().zip(&mut tallies) {
            for (setting, tally) in knob.others.iter().zip(of_knob) {
                // a setting with which the night cannot be reduced has no errors there
                match reduced(setting) {
                    Ok(measured) => tally.add(&measured, first.cpu_s),
                    Err(Error::Io { path, source }) => return Err(Error::Io { path, source }),
                    Err(_) => {}
                }
            }
        }
        let again = reduced(&DEFAULT)?;
        default.add(&Measured { cpu_s: again.cpu_s, ..first.clone() }, first.cpu_s);
        default_frame_us.push(1e6 * first.cpu_s / night.frames() as f64);
    }
    stopwatch.progress.done();
    let frame_us = crate::base::stats::median(&mut default_frame_us).unwrap_or(f64::NAN);
    let of_knob = |(knob, tallies): (&&Knob, &Vec<Tally>)| {
        let own = default.point(knob.default, (frame_us, true));
        let others = knob.others.iter().zip(tallies).map(|(s, tally)| tally.point(s.text, (frame_us, false)));
        Series { label: knob.label.into(), points: own.into_iter().chain(others.flatten()).collect() }
    };
    Ok(knobs.iter().zip(&tallies).map(of_knob).collect())
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    Ok(Sweep {
        knob: "key of the configuration",
        work: "one target frame, its share of the night included",
        error: "mag",
        reference: "the magnitudes that were simulated, of frames whose verdict is not reject",
        default_because: "all keys together change the time by a tenth; the error is that of noise and zeropoint, and of faint targets among trails",
        series: series(stopwatch, Of::Target, stopwatch.effort.of(3, 15))?,
    })
}

pub(super) fn zeropoint_sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    Ok(Sweep {
        knob: "key of the configuration",
        work: "one star frame, its share of the flats and the fit included",
        error: "mag",
        reference: "the zeropoint that was simulated, at airmass 1.1, 1.5, 2 and B-V 0.65",
        default_because: "the error is that of 6 pointings that scatter by 0.02 mag; what saves time here costs stars",
        series: series(stopwatch, Of::Zeropoint, stopwatch.effort.of(3, 25))?,
    })
}
