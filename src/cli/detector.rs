//! `satphot detector`: gain, read noise, pedestal, step and saturation from flats, bias frames and lights.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;
use satphot::Error;
use satphot::base::threads::with_threads;
use satphot::config::Config;
use satphot::detector::measure::Effort;
use satphot::figures::{TransferCurve, photon_transfer};
use satphot::frames::{Detector, Role, classify};
use satphot::pipeline::detector::checks::Known;
use satphot::pipeline::detector::checks::check_group;
use satphot::pipeline::detector::checks::groups;
use satphot::pipeline::detector::gain_check::GainCheck;
use satphot::pipeline::detector::report::{checks_text, short, two, write_checks};
use satphot::pipeline::survey::files::Survey;
use satphot::pipeline::survey::files::Unreadable;
use satphot::pipeline::survey::read::survey;

use super::{Common, print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot detector flats/*.fits bias/*.fits              what the frames themselves say
  satphot detector -c pipeline.toml night/ -o checks     against the night's table; detector.toml and a figure
  satphot detector *.fits --camera asi6200mm --pedestal 500
  satphot detector sky*.fits --flat sky*.fits --bias b1.fits b2.fits   when IMAGETYP does not tell

What to take, for each gain setting you use:
  two flats one after the other at one level: their difference holds no pixel response, only noise;
  such pairs at three or more levels (5, 20, 60 % of full scale): the slope is free of the pedestal;
  two bias frames (shortest exposure, closed): pedestal and read noise;
  a frame of a bright star field: where pixels saturate.
The gain cannot be measured from one flat. Flats must not be calibrated, stacked or smoothed.

The gain is e-/ADU = level / variance. A gain wrong by 10 % moves magnitudes by 0.11 mag between gain
settings and makes every error bar 5 % wrong. Low bits padded with zeros (values 16 or 4 apart) are
where drivers give EGAIN per count of the converter and not per ADU of the file.";

/// Checks the detector: gain from pairs of flats, read noise and pedestal from bias frames, the step of the raw values
/// and the level at which pixels saturate, each against the camera's table and the headers.
///
/// Files are distinguished by IMAGETYP as in a run. Without a pipeline.toml the frames are compared with their headers,
/// and with the camera of the table that INSTRUME names.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DetectorVerb {
    /// Flats, bias frames, darks, star and target frames, or folders of them
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// These are flats, whatever their headers say
    #[arg(long, value_name = "FILE", num_args = 1..)]
    flat: Vec<PathBuf>,
    /// These are bias frames
    #[arg(long, value_name = "FILE", num_args = 1..)]
    bias: Vec<PathBuf>,
    /// Camera of the table (detector.camera)
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Bias level, where no bias frame is named (detector.pedestal_adu)
    #[arg(long, value_name = "ADU")]
    pedestal: Option<f64>,
    #[command(flatten)]
    common: Common,
    /// Folder to write detector.toml and photon_transfer.svg to
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A configuration to read headers by, where there is none.
const NO_NIGHT: &str =
    "preset = \"macquarie-cdk24\"\n[night]\nname = \"detector\"\ninput = [\".\"]\noutput = \"satphot-out\"\n";

impl DetectorVerb {
    pub fn execute(self) -> anyhow::Result<()> {
        let mut common = self.common.clone();
        common.sets.extend(self.camera.iter().map(|c| format!("detector.camera={c:?}")));
        common.sets.extend(self.pedestal.iter().map(|p| format!("detector.pedestal_adu={p:?}")));
        // the default configuration may be missing, a named one may not
        let configured = common.config.exists() || common.config != Path::new("pipeline.toml");
        let mut config = if configured { common.load()? } else { Config::from_text(NO_NIGHT, &common.sets)? };
        config.header.check_site = false; // where the camera stood does not matter here
        let survey = self.survey(&config, configured)?;
        for unreadable in survey.unreadable.iter().filter(|_| !common.quiet) {
            tell(&format!("skipped: {}", unreadable.error));
        }
        for ignored in survey.others.iter().filter(|e| e.role == Role::Ignored && !common.quiet) {
            tell(&format!("skipped: {}: {}", ignored.path.display(), ignored.role_reason));
        }
        let detector = self.detector(&config, configured, &survey)?;
        let known = Known {
            detector: detector.as_ref(),
            pedestal_adu: (configured || self.pedestal.is_some()).then_some(config.detector.pedestal_adu),
            clip_radius_px: config.photometry.clip_radius_px.filter(|_| configured),
        };
        let groups = groups(&survey, &config)?;
        if groups.is_empty() {
            return Err(Error::NoInput {
                path: self.files.first().or(self.flat.first()).cloned().unwrap_or_default(),
                problem: "holds no frame that can be used; name flats with --flat, bias frames with --bias".into(),
            }
            .into());
        }
        let checks: Vec<GainCheck> =
            with_threads(common.jobs, || groups.iter().map(|group| check_group(group, &known, Effort::ALL)).collect())?;
        print(&checks_text(&checks));
        if let Some(folder) = &self.out {
            satphot::base::file::make_folder(folder)?;
            print(&format!("{}\n", write_checks(folder, &checks)?.display()));
            let figure = folder.join("photon_transfer.svg");
            photon_transfer(&figure, &curves(&checks))?;
            print(&format!("{}\n", figure.display()));
        }
        Ok(())
    }

    /// The files by role: those named by role, then the others (the night's own if none are named).
    fn survey(&self, config: &Config, configured: bool) -> anyhow::Result<Survey> {
        let by_option = !self.flat.is_empty() || !self.bias.is_empty();
        let mut found = if !self.files.is_empty() || (configured && !by_option) {
            survey(config, &self.files, &[])?
        } else if by_option {
            Survey::default()
        } else {
            let problem = "name flats and bias frames (`satphot detector --help` says which to take)".into();
            return Err(Error::NoInput { path: PathBuf::from("."), problem }.into());
        };
        let real = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let mut named: BTreeSet<PathBuf> = self.flat.iter().chain(&self.bias).map(|f| real(f)).collect();
        let by_role = |path: &Path| named.contains(&real(path));
        found.flats.retain(|e| !by_role(&e.path));
        found.targets.retain(|e| !by_role(&e.path));
        found.others.retain(|e| !by_role(&e.path));
        found.unreadable.retain(|u| !by_role(&u.path));
        found.pointings.iter_mut().for_each(|p| p.retain(|e| !by_role(&e.path)));
        // as a flat every card needed here is read, whatever the frame is
        let mut as_flat = config.clone();
        as_flat.frames.flat = vec!["*".into()];
        as_flat.frames.ignore.clear();
        let roles = self.flat.iter().map(|f| (f, Role::Flat)).chain(self.bias.iter().map(|f| (f, Role::Bias)));
        for (path, role) in roles {
            if !named.remove(&real(path)) {
                continue; // named twice
            }
            match classify(path, &as_flat, &[]) {
                Ok(exposure) if role == Role::Flat => found.flats.push(exposure),
                Ok(mut exposure) => {
                    exposure.role = role;
                    found.others.push(exposure);
                }
                Err(error) => found.unreadable.push(Unreadable { path: path.clone(), error }),
            }
        }
        Ok(found)
    }

    /// The camera's table: the configuration's, or that of the camera the headers name.
    fn detector(&self, config: &Config, configured: bool, survey: &Survey) -> anyhow::Result<Option<Detector>> {
        let own = self.common.sets.iter().any(|s| s.starts_with("detector."));
        if configured || self.camera.is_some() || own {
            return Ok(Some(Detector::from_config(&config.detector)?));
        }
        let frames = survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets);
        let mut named = frames.chain(&survey.others).filter_map(|e| e.header.text("INSTRUME"));
        let camera = named.find_map(|camera| {
            let detector = satphot::config::Detector { camera, ..config.detector.clone() };
            Detector::from_config(&detector).ok()
        });
        Ok(camera)
    }
}

/// The figure's curves, one per gain setting.
fn curves(checks: &[GainCheck]) -> Vec<TransferCurve> {
    let label = |c: &GainCheck| {
        let mut lines = vec![c.setting.map_or("no gain setting".into(), |s| format!("setting {s}"))];
        if let (Some(g), Some(err)) = (c.measured_e_per_adu, c.measured_err_e_per_adu) {
            lines.push(format!("{} ± {} e-/ADU", short(g), two(err)));
        }
        lines.extend(c.configured_e_per_adu.map(|g| format!("in use {}", short(g))));
        lines
    };
    checks
        .iter()
        .map(|c| TransferCurve {
            label: label(c),
            points: c.blocks.iter().flatten().copied().collect(),
            measured: c.transfer.as_ref().map(|t| (t.gain.e_per_adu, t.dark_var_adu2)),
            in_use_e_per_adu: c.configured_e_per_adu,
        })
        .collect()
}
