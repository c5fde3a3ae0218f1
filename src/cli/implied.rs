//! The configuration that the headers of a folder imply, as the text of a pipeline.toml.
//!
//! What the headers state is a live key with its source behind it; what only the observer knows is a comment to fill in,
//! so that a run refuses the file until it is, and names it. Pixels are read for the level of the bias frames, and for gain and read
//! noise of a camera of which neither table nor headers know them. It does not cover optics that no header states.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use satphot::Error;
use satphot::bands::{Meaning, filter_meaning};
use satphot::base::stats::median;
use satphot::base::time::iso_utc;
use satphot::brightness::{Catalogue, Entry};
use satphot::config::Config;
use satphot::detector::measure::{Effort, Group};
use satphot::fits::find_files;
use satphot::frames::header::{header_site, optics};
use satphot::frames::{Exposure, Role, classify, overscan, read_box, table_camera};
use satphot::pipeline::detector::checks::{Known, check_group};
use satphot::pipeline::detector::gain_check::GainCheck;

/// Side of the square in the middle of a bias frame whose median is its level \[px\].
const BIAS_BOX_PX: usize = 256;

/// Magnitudes for a small relative change of flux: 2.5 / ln 10.
const MAG_PER_FRAC: f64 = 2.5 * std::f64::consts::LOG10_E;

/// What the headers of a folder imply.
#[derive(Debug)]
pub struct Implied {
    /// The text of a pipeline.toml.
    pub text: String,
    /// What is missing, and what gives it.
    pub missing: Vec<String>,
    /// Number of frames read.
    pub n_frames: usize,
}

/// A value with where it is from.
type Stated = (String, String);

/// Reads the headers of a folder and writes the configuration they imply; `input` is the folder as the file names it, `file`
/// the name of the file for the commands that it gives.
///
/// # Errors
/// [`Error::NoInput`] for a folder without frames.
pub fn implied(folder: &Path, input: &str, file: &str) -> anyhow::Result<Implied> {
    let any = Config::from_text(
        "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"o\"\n",
        &[],
    )?;
    let mut frames = Vec::new();
    let mut unreadable = 0;
    for path in find_files(&[PathBuf::from(folder)])? {
        match classify(&path, &any, &[]) {
            Ok(frame) => frames.push(frame),
            Err(_) => unreadable += 1,
        }
    }
    if frames.is_empty() {
        return Err(Error::NoInput {
            path: folder.into(),
            problem: format!("none of {unreadable} FITS files can be read; `satphot inspect` says why of each"),
        }
        .into());
    }
    frames.sort_by(|a, b| mid(a).cmp(&mid(b)).then_with(|| a.path.cmp(&b.path)));
    let mut writer = Writer { frames: &frames, any: &any, file, text: String::new(), missing: Vec::new() };
    if unreadable > 0 {
        writer.missing.push(format!("{unreadable} files cannot be read: `satphot inspect {input}` says why"));
    }
    writer.head(input);
    writer.site();
    let cameras = writer.cameras();
    writer.telescope(&cameras[0]);
    writer.detector("detector", &cameras[0]);
    writer.filters();
    writer.stars();
    writer.satellites()?;
    for camera in &cameras[1..] {
        writer.instrument(camera);
    }
    Ok(Implied { text: writer.text, missing: writer.missing, n_frames: frames.len() })
}

fn mid(frame: &Exposure) -> Option<hifitime::Epoch> {
    frame.time.as_ref().map(|t| t.mid)
}

fn is_light(frame: &Exposure) -> bool {
    matches!(frame.role, Role::Stars | Role::Target)
}

/// The value that most frames state, its source, and how many others there are.
fn most<'a>(frames: impl Iterator<Item = &'a Exposure>, of: impl Fn(&Exposure) -> Option<Stated>) -> Option<Stated> {
    let mut counts: BTreeMap<String, (usize, String)> = BTreeMap::new();
    for (value, source) in frames.filter_map(of) {
        counts.entry(value).or_insert((0, source)).0 += 1;
    }
    let n: usize = counts.values().map(|(n, _)| n).sum();
    let (value, (own, source)) = counts.into_iter().max_by_key(|(_, (n, _))| *n)?;
    Some((value, if own == n { source } else { format!("{source} of {own} of {n} frames") }))
}

/// The number of the first of these keywords.
fn number(frame: &Exposure, keywords: &[&str]) -> Option<(f64, String)> {
    keywords.iter().find_map(|k| Some((frame.header.number(k)?, (*k).to_owned())))
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.trim().to_owned()).to_string()
}

struct Writer<'a> {
    frames: &'a [Exposure],
    any: &'a Config,
    file: &'a str,
    text: String,
    missing: Vec<String>,
}

impl Writer<'_> {
    /// A key with its value and source, or the line to fill in and what it means.
    fn key(&mut self, key: &str, value: Option<Stated>, example: &str, what: &str) {
        match value {
            Some((value, source)) => {
                let _ = writeln!(self.text, "{:<32} # {source}", format!("{key} = {value}"));
            }
            None => {
                let _ = writeln!(self.text, "# {:<30} # FILL IN: {what}", format!("{key} = {example}"));
                self.missing.push(format!("{key}: {what}"));
            }
        }
    }

    fn head(&mut self, input: &str) {
        let first = self.frames.iter().find(|f| is_light(f) && f.time.is_some());
        // a night that begins in the evening keeps its date after midnight at most longitudes: that of noon before
        let name = first.and_then(mid).map(|t| iso_utc(t, 0)[..10].to_owned()).unwrap_or_else(|| "night".into());
        let _ = write!(
            self.text,
            "# Written by satphot from the headers of {} frames. Lines with FILL IN are yours; `satphot init` writes every key\n\
             # with its meaning.\n\n[night]\nname = {}\ninput = [{}]\noutput = \"satphot-out\"\n",
            self.frames.len(),
            quoted(&name),
            quoted(input)
        );
    }

    fn site(&mut self) {
        let of = |pick: fn(&satphot::frames::header::HeaderSite) -> Option<f64>| {
            most(self.frames.iter().filter(|f| is_light(f)), |f| {
                let site = header_site(&f.header, &self.any.header.aliases).0?;
                Some((format!("{:?}", pick(&site)?), site.source))
            })
        };
        let [lat, lon, alt] = [of(|s| Some(s.lat_deg)), of(|s| Some(s.lon_deg)), of(|s| s.alt_m)];
        let name = most(self.frames.iter(), |f| text(f, &["OBSERVAT", "SITENAME", "OBSERVATORY"]));
        self.text += "\n[site]\n";
        self.key("name", name.or(Some((quoted("my site"), "any name".into()))), "", "");
        self.key("lat_deg", lat, "-33.7703", "latitude, north positive [deg]");
        self.key("lon_deg", lon, "151.1113", "longitude, east positive [deg]");
        self.key("alt_m", alt, "70.0", "height [m]");
    }

    /// The cameras of the light frames, the commonest first; one without a name where no header has one.
    fn cameras(&self) -> Vec<Camera> {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for frame in self.frames.iter().filter(|f| is_light(f)) {
            *counts.entry(self.camera_of(frame)).or_default() += 1;
        }
        let mut cameras: Vec<Camera> = counts.into_iter().map(|(name, n)| Camera { name, n }).collect();
        cameras.sort_by(|a, b| b.n.cmp(&a.n).then_with(|| a.name.cmp(&b.name)));
        if cameras.is_empty() {
            cameras.push(Camera { name: String::new(), n: 0 });
        }
        cameras
    }

    fn camera_of(&self, frame: &Exposure) -> String {
        optics(&frame.header, &self.any.header.aliases).camera.map(|c| c.value.trim().to_owned()).unwrap_or_default()
    }

    fn of_camera(&self, camera: &Camera) -> Vec<&Exposure> {
        self.frames.iter().filter(|f| self.camera_of(f) == camera.name).collect()
    }

    fn telescope(&mut self, camera: &Camera) {
        let frames = self.of_camera(camera);
        let name = most(frames.iter().copied(), |f| text(f, &["TELESCOP"]));
        let aperture = most(frames.iter().copied(), |f| {
            let (mm, key) = number(f, &["APTDIA", "APERTURE"]).filter(|(mm, _)| *mm > 5.0)?;
            Some((format!("{:?}", mm / 1000.0), format!("{key}, mm")))
        });
        let focal = most(frames.iter().copied(), |f| {
            let (mm, key) = number(f, &["FOCALLEN", "FOCAL"]).filter(|(mm, _)| *mm > 1.0)?;
            Some((format!("{mm:?}"), format!("{key}; the stars decide: more than 2 % off is an error")))
        });
        self.text += "\n[telescope]\n";
        self.key("name", name.or(Some((quoted("my telescope"), "any name".into()))), "", "");
        self.key("aperture_m", aperture, "0.3", "clear aperture [m]");
        self.key("focal_length_mm", focal, "2000.0", "focal length [mm]");
    }

    fn detector(&mut self, table: &str, camera: &Camera) {
        let frames = self.of_camera(camera);
        let lights = || frames.iter().copied().filter(|f| is_light(f));
        let in_table = table_camera(&camera.name);
        let known = in_table.is_some();
        let name = (!camera.name.is_empty()).then(|| {
            let source = format!("INSTRUME = {} of {} frames", quoted(&camera.name), camera.n);
            (quoted(in_table.as_ref().unwrap_or(&camera.name)), source)
        });
        let pixel = most(lights(), |f| {
            let (um, key) = number(f, &["XPIXSZ", "PIXSIZE1", "PIXSIZE"]).filter(|(um, _)| *um > 0.5)?;
            let unbinned = um / f64::from(f.binning.max(1));
            // no sensor has pixels of less than 1 µm: some programs give the unbinned size
            let um = if unbinned > 1.0 { unbinned } else { um };
            Some((format!("{:?}", (um * 1e4).round() / 1e4), format!("{key} over the binning")))
        });
        let bias = self.bias_level(&frames);
        let egain = lights().all(|f| f.header_e_per_adu.is_some()) && lights().next().is_some();
        let noise = lights().all(|f| optics(&f.header, &self.any.header.aliases).read_noise_e.is_some());
        let settings: Vec<i64> = {
            let mut all: Vec<i64> = lights().filter_map(|f| f.setting.map(|s| s.0)).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let (needs_gain, needs_noise) = (!known && !egain, !(known || egain && noise));
        let measured = if needs_gain || needs_noise { photon_transfer(&frames, &settings) } else { Vec::new() };
        let _ = writeln!(self.text, "\n[{table}]");
        self.key("camera", name, "\"asi6200mm\"", "the camera, as INSTRUME names it");
        self.key("pixel_um", pixel, "3.76", "pixel pitch, unbinned [um]");
        self.key("pedestal_adu", bias, "500.0", "bias level [ADU]: the median of a bias frame");
        if !known && egain {
            let _ = writeln!(
                self.text,
                "{:<32} # the camera is not in the table, EGAIN is in every header",
                "use_header_egain = true"
            );
        }
        let of_gain = |c: &GainCheck| c.measured_e_per_adu.zip(c.measured_err_e_per_adu);
        let errors = measured.iter().filter_map(|(_, c)| of_gain(c)).map(|(g, err)| MAG_PER_FRAC * err / g);
        let worst_mag = errors.fold(0.0, f64::max);
        if needs_gain && worst_mag > 0.0 {
            let line = format!("gain_table_err_mag = {:?}", (worst_mag * 1e4).ceil() / 1e4);
            let _ = writeln!(self.text, "{line:<32} # error of the photon transfer below [mag]");
        }
        if needs_gain {
            self.measured_table(table, "e_per_adu", "electrons per ADU", &measured, &|c| {
                let (g, err) = of_gain(c)?;
                Some((g, format!("+- {err:.4}: photon transfer of {} pairs of flats ({})", c.n_pairs, c.method)))
            });
        }
        if needs_noise {
            self.measured_table(table, "read_noise_e", "read noise [e-]", &measured, &|c| {
                let (noise_e, err_e) = c.read_noise_e.zip(c.read_noise_err_e)?;
                Some((noise_e, format!("+- {err_e:.3}: pairs of {} bias frames", c.n_biases)))
            });
        }
    }

    /// A table of one number for each gain setting, as measured; a line to fill in for each that is not.
    fn measured_table(
        &mut self,
        table: &str,
        key: &str,
        what: &str,
        measured: &[(i64, GainCheck)],
        of: &dyn Fn(&GainCheck) -> Option<(f64, String)>,
    ) {
        let lacks = measured.iter().filter(|(_, check)| of(check).is_none());
        let lacks: Vec<(i64, String)> = lacks.map(|(setting, check)| (*setting, check.method.clone())).collect();
        let header =
            if lacks.len() == measured.len() { format!("# [{table}.{key}]") } else { format!("[{table}.{key}]") };
        let fill_in = if lacks.is_empty() { "" } else { "FILL IN: " };
        let _ = writeln!(self.text, "{header:<32} # {fill_in}{what} of each gain setting");
        for (setting, check) in measured {
            let (line, why) = match of(check) {
                Some((value, why)) => (format!("\"{setting}\" = {:?}", (value * 1e5).round() / 1e5), why),
                None => (format!("# \"{setting}\" = 1.0"), "an example".to_owned()),
            };
            let _ = writeln!(self.text, "{line:<32} # {why}");
        }
        if let Some((_, why)) = lacks.first() {
            let settings: Vec<String> = lacks.iter().map(|(setting, _)| setting.to_string()).collect();
            self.missing.push(format!(
                "{table}.{key} of gain settings {}: `satphot detector` measures it from pairs of flats and of bias frames{}",
                settings.join(", "),
                if why.is_empty() { String::new() } else { format!(" ({why})") }
            ));
        }
    }

    /// The median level of the bias frames in their middle.
    fn bias_level(&self, frames: &[&Exposure]) -> Option<Stated> {
        let biases = frames.iter().filter(|f| f.role == Role::Bias);
        let of_bias = |f: &&Exposure| {
            let side = BIAS_BOX_PX.min(f.size_px.0).min(f.size_px.1);
            let origin = ((f.size_px.0 - side) / 2, (f.size_px.1 - side) / 2);
            let pixels = read_box(f, origin, (side, side)).ok()?;
            median(&mut pixels.into_iter().map(f64::from).collect::<Vec<_>>())
        };
        let mut levels: Vec<f64> = biases.take(5).filter_map(of_bias).collect();
        let mut what = "bias frames";
        if levels.is_empty() {
            what = "overscans (BIASSEC)";
            let of_overscan = |f: &&Exposure| Some(overscan(f, None).ok()??.adu);
            levels = frames.iter().filter_map(of_overscan).take(5).collect();
        }
        let level = median(&mut levels)?;
        Some((format!("{:?}", (level * 10.0).round() / 10.0), format!("median of {} {what}", levels.len())))
    }

    fn filters(&mut self) {
        let mut counts: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
        for frame in self.frames.iter().filter(|f| is_light(f) || f.role == Role::Flat) {
            let at = usize::from(frame.role == Role::Flat);
            counts.entry(frame.filter.as_deref().unwrap_or("").trim()).or_default()[at] += 1;
        }
        self.text += "\n# filters of the night:\n";
        for (name, [lights, flats]) in counts {
            let means = match filter_meaning(name) {
                Meaning::Unfiltered => "unfiltered: calibrated to V by the colour term".to_owned(),
                Meaning::Band(band) => format!("band {band}"),
                Meaning::Either(a, b) => format!("band {a} or {b}: the other filters decide, else photometry.band"),
                _ => "not known: photometry.band names its band".to_owned(),
            };
            let shown = if name.is_empty() { "no FILTER" } else { name };
            let _ = writeln!(self.text, "#   {shown}: {lights} light frames, {flats} flats; {means}");
        }
    }

    fn stars(&mut self) {
        let _ = write!(
            self.text,
            "\n[stars]                          # `satphot fetch stars -c {}` writes the catalogue\ncatalogue = \"catalogue.csv\"\n\
             bv_range_mag = [0.2, 0.9]\nv_range_mag = [10.5, 15.5]\n",
            self.file
        );
        self.missing.push(format!("catalogue.csv: `satphot fetch stars -c {}`", self.file));
    }

    /// The elements of the satellites that OBJECT names, and their models.
    fn satellites(&mut self) -> anyhow::Result<()> {
        let catalogue = Catalogue::load(None)?;
        let mut objects: BTreeMap<String, usize> = BTreeMap::new();
        for frame in self.frames.iter().filter(|f| is_light(f)) {
            *objects.entry(frame.object.as_deref().unwrap_or("").trim().to_owned()).or_default() += 1;
        }
        let date = self.frames.iter().find(|f| is_light(f)).and_then(mid).map(|t| iso_utc(t, 0)[..10].to_owned());
        let date = date.unwrap_or_else(|| "YYYY-MM-DD".into());
        self.text += "\n# OBJECT of the light frames; those that no elements name are star fields:\n";
        let mut models: Vec<(String, &Entry)> = Vec::new();
        let mut fetched = String::new();
        for (object, n) in &objects {
            let entry = catalogue.entries().iter().find(|e| !object.is_empty() && e.is_of(object, 0));
            let shown = if object.is_empty() { "(none)" } else { object };
            let _ = writeln!(
                self.text,
                "#   {shown}: {n} frames{}",
                entry.map(|e| format!("; {}", e.title)).unwrap_or_default()
            );
            if let Some(entry) = entry {
                let number = entry.objects.iter().find_map(|o| o.trim().parse::<u64>().ok());
                let which = number.map_or(format!("--name {}", quoted(object)), |n| format!("--norad {n}"));
                fetched = format!("satphot fetch elements {which} --date {date} -o elements.tle");
                models.push((object.clone(), entry));
            }
        }
        if fetched.is_empty() {
            fetched = format!("satphot fetch elements --norad NUMBER --date {date} -o elements.tle");
        }
        let _ = write!(self.text, "\n[orbit]                          # `{fetched}`\nelements = \"elements.tle\"\n");
        self.missing.push(format!("elements.tle: `{fetched}`"));
        // several models of one satellite are a choice of the observer
        let choices = |object: &str| catalogue.entries().iter().filter(|e| e.is_of(object, 0)).count();
        match models.as_slice() {
            [] => {
                self.text += "\n# [model]                        # the model to compare with: `satphot satellites` lists them\n\
                              # satellite = \"iss\"\n";
            }
            [(object, entry)] if choices(object) == 1 => {
                let _ = write!(
                    self.text,
                    "\n[model]\n{:<32} # OBJECT = '{object}'\n",
                    format!("satellite = {}", quoted(&entry.name))
                );
            }
            several => {
                for (object, _) in several {
                    let names: Vec<&str> =
                        catalogue.entries().iter().filter(|e| e.is_of(object, 0)).map(|e| e.name.as_str()).collect();
                    let _ = write!(
                        self.text,
                        "\n# [[satellites]]                # the model of this satellite: {}\n# objects = [{}]\n# model = {}\n",
                        names.join(", "),
                        quoted(object),
                        quoted(names.first().copied().unwrap_or_default())
                    );
                }
            }
        }
        Ok(())
    }

    fn instrument(&mut self, camera: &Camera) {
        let name: String = camera.name.chars().filter(|c| c.is_ascii_alphanumeric()).collect::<String>().to_lowercase();
        let name = if name.is_empty() { "other".into() } else { name };
        let _ = write!(self.text, "\n[[instruments]]\nname = {}\n", quoted(&name));
        self.detector("instruments.detector", camera);
        let focal = most(self.of_camera(camera).into_iter(), |f| {
            number(f, &["FOCALLEN", "FOCAL"]).map(|(mm, _)| (format!("{mm:?}"), String::new()))
        });
        if let Some((mm, _)) = focal {
            let _ = write!(
                self.text,
                "# [instruments.telescope]        # where it is another than that above\n# name = \"other telescope\"\n# aperture_m = 0.3\n\
                 # focal_length_mm = {mm}\n"
            );
        }
    }
}

/// A camera and its number of light frames.
struct Camera {
    name: String,
    n: usize,
}

/// The text of the first of these keywords, in quotes.
fn text(frame: &Exposure, keywords: &[&str]) -> Option<Stated> {
    keywords.iter().find_map(|k| {
        let value = frame.header.text(k).map(|v| v.trim().to_owned()).filter(|v| !v.is_empty())?;
        Some((quoted(&value), (*k).to_owned()))
    })
}

/// Gain and read noise of each setting by the flats of the filter with the most, and the bias frames.
fn photon_transfer(frames: &[&Exposure], settings: &[i64]) -> Vec<(i64, GainCheck)> {
    // frames without GAIN are of one setting, which the tables call 0
    let all: Vec<Option<i64>> =
        if settings.is_empty() { vec![None] } else { settings.iter().copied().map(Some).collect() };
    let of_setting = |setting: &Option<i64>| {
        let of = |role: Role| {
            let same = move |f: &&Exposure| f.role == role && f.setting.map(|s| s.0) == *setting;
            frames.iter().copied().filter(same).cloned().collect::<Vec<_>>()
        };
        let (all_flats, biases, darks) = (of(Role::Flat), of(Role::Bias), of(Role::Dark));
        let mut filters: BTreeMap<Option<&str>, usize> = BTreeMap::new();
        all_flats.iter().for_each(|f| *filters.entry(f.filter.as_deref()).or_default() += 1);
        let filter = filters.into_iter().max_by_key(|(_, n)| *n).and_then(|(filter, _)| filter.map(str::to_owned));
        let flats = all_flats.into_iter().filter(|f| f.filter == filter).collect();
        let lights = of(Role::Stars).into_iter().chain(of(Role::Target)).collect();
        let check = check_group(&Group { flats, biases, darks, lights }, &Known::default(), Effort::RUN);
        (setting.unwrap_or(0), check)
    };
    all.iter().map(of_setting).collect()
}
